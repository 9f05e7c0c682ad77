"""Multi-cover objective: value of a target by the number of sensors that see it, and its upper bound."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import numpy as np

from ...arrays import Integer


@dataclass(frozen=True, eq=False)
class MultiCover:
    """A non-decreasing function of how many sensors see a target, in whole units.

    Parameters
    ----------
    values : (top + 1,) int64
        Value of a target seen 0, 1, … times; the last one applies to all that are seen more often.
    rises : (top + 1, top + 1, top) int64
        Increments by the next sensor, the one after it, … of the least concave function above the value of a target
        that is seen n times and can be seen by l more. This function is exact at n. For l = 1 the first increment is
        what one sensor really adds.
    unit : int
        Number of units in a value of 1.
    """

    values: Integer
    rises: Integer
    unit: int

    @property
    def top(self) -> int:
        """Number of sensors beyond which nothing is added."""
        return len(self.values) - 1

    @property
    def concave(self) -> bool:
        """Whether each sensor adds no more than the one before it."""
        return bool((np.diff(self.values, 2) <= 0).all())

    def value(self, times: Integer) -> Integer:
        """Return the value of targets that are seen ``times`` times, of the same shape."""
        value: Integer = self.values[np.minimum(times, self.top)]
        return value

    def increment(self, times: Integer, left: int, level: int = 0) -> Integer:
        """Return the largest increment by the next sensor, or by the one ``level`` sensors after it.

        Parameters
        ----------
        times : array of int64
            Number of sensors that see each target.
        left : int
            Number of sensors to come.
        """
        more: Integer = self.rises[np.minimum(times, self.top), min(left, self.top), level]
        return more


def multi_cover(values: Sequence[Fraction]) -> MultiCover:
    """Return a function by its value for 0, 1, … sensors, which rises to its end."""
    top = len(values) - 1
    rises = [[_concave_rises(values[n : n + left + 1], top) for left in range(top + 1)] for n in range(top + 1)]
    unit = math.lcm(*(rise.denominator for row in rises for steps in row for rise in steps))
    return MultiCover(
        values=np.array([int(value * unit) for value in values], dtype=np.int64),
        rises=np.array([[[int(rise * unit) for rise in steps] for steps in row] for row in rises], dtype=np.int64),
        unit=unit,
    )


def _concave_rises(values: Sequence[Fraction], number: int) -> list[Fraction]:
    """Return the increments of the least concave function above points, zero after the last."""
    corners = _upper_hull(values)
    rises = [(values[b] - values[a]) / (b - a) for a, b in pairwise(corners) for _ in range(a, b)]
    return rises + [Fraction(0)] * (number - len(rises))


def _upper_hull(values: Sequence[Fraction]) -> list[int]:
    """Return the corners of the least concave function above the points."""
    corners: list[int] = []
    for right in range(len(values)):
        while len(corners) > 1:
            left, middle = corners[-2:]
            rise, run = values[right] - values[left], right - left
            if (values[middle] - values[left]) * run > rise * (middle - left):
                break
            corners.pop()
        corners.append(right)
    return corners


COVERAGE = multi_cover([Fraction(0), Fraction(1)])  # one sensor is enough
