"""Value of a target by the number of sensors that see it: a concave function."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from ...arrays import Integer


@dataclass(frozen=True, eq=False)
class MultiCover:
    """A non-decreasing function of the number of sensors that see a target, in whole units; its steps never grow.

    Parameters
    ----------
    values : (top + 1,) int64
        Value of a target seen 0, 1, … times; the last one applies to all that are seen more often.
    unit : int
        Number of units in a value of 1.
    """

    values: Integer
    unit: int

    @property
    def top(self) -> int:
        """Number of sensors beyond which nothing is added."""
        return len(self.values) - 1

    def value(self, times: Integer) -> Integer:
        """Return the value of targets that are seen ``times`` times, of the same shape."""
        value: Integer = self.values[np.minimum(times, self.top)]
        return value

    def increment(self, times: Integer, level: int = 0) -> Integer:
        """Return the increment by the next sensor, or by the one ``level`` sensors after it.

        Parameters
        ----------
        times : array of int64
            Number of sensors that see each target.
        """
        return self.value(times + level + 1) - self.value(times + level)


def multi_cover(values: Sequence[Fraction]) -> MultiCover:
    """Return a function by its value for 0, 1, … sensors, which rises to its end in steps that never grow."""
    unit = math.lcm(*(value.denominator for value in values))
    return MultiCover(np.array([int(value * unit) for value in values], dtype=np.int64), unit)


COVERAGE = multi_cover([Fraction(0), Fraction(1)])  # one sensor is enough
