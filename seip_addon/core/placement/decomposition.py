r"""Upper bounds by Lagrangian decomposition into parts, for many sensors.

The linear relaxation counts a target twice that two sensors see. Here the
candidates are divided into parts, and only a target that several parts
see is relaxed: with multipliers :math:`0 \le \lambda_j \le w_j`,

.. math::
    L(\lambda) = \sum_j (w_j - \lambda_j) + \max_{\sum_d m_d \le N} \sum_d F_d(m_d),

where :math:`F_d(m)` bounds what m sensors of part d cover together of the
weights :math:`\lambda`: for one and two it is the best choice itself, for more
the smaller of :math:`m/2` times the best two (coverage is submodular) and all
that the part sees. This is Lagrangian decomposition (Guignard and Kim 1987) with
overlaps kept within the parts.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Boolean, Float, Integer
from ..progress import Progress
from .bounds import MIN_STEP, SubgradientDescent
from .greedy import greedy
from .reduced_problem import Instance, Numbers
from .search_limits import Clock

ITERATIONS = 2000

SENSORS_PER_PART = 1.8
"""So many sensors there are for each part: of two their overlap is known."""


@dataclass(frozen=True, eq=False)
class _Part:
    """Candidates near each other.

    Parameters
    ----------
    targets : (s,) int64
        Those that any of them sees.
    matrix : (n, s) float
    excluded : (n, n) bool
        Pairs that cannot be chosen together, everyone with itself included.
    """

    targets: Integer
    matrix: Numbers
    excluded: Boolean

    def values(self, multipliers: Float, count: int) -> tuple[Float, list[Float]]:
        """Return F for no sensor up to ``count``, and how often each target counts in it for 1, 2 and all."""
        weight = multipliers[self.targets].astype(self.matrix.dtype)
        score = self.matrix @ weight
        first = int(np.argmax(score))
        on_top = np.where(self.excluded[first], 0.0, score - self.matrix @ (weight * self.matrix[first]))
        # with a partner of a smaller score no pair is better than the best with the first
        rows = np.flatnonzero(score >= on_top.max())
        pairs = score[rows, None] + score[rows] - (self.matrix[rows] * weight) @ self.matrix[rows].T
        pairs[self.excluded[np.ix_(rows, rows)]] = 0.0
        one, other = np.unravel_index(int(np.argmax(pairs)), pairs.shape)
        best_two = max(float(pairs[one, other]), float(score[first]))
        seen_by_two = np.maximum(self.matrix[rows[one]], self.matrix[rows[other]])
        if best_two == score[first]:
            seen_by_two = self.matrix[first]
        number = np.arange(count + 1)
        value = np.minimum(best_two * np.maximum(number, 2) / 2, float(weight.sum(dtype=np.float64)))
        value[:2] = 0.0, score[first]
        return value, [self.matrix[first], seen_by_two, np.ones(len(self.targets))]


def decomposition_bound(
    instance: Instance, goal: float, clock: Clock, seconds: float
) -> Generator[Progress, None, float]:
    """Return a weight that no placement exceeds, the budget and the mandatory groups aside.

    Parameters
    ----------
    goal : float
        The search ends when the bound falls below.
    seconds : float
        Longest time to search.
    """
    parts = _parts(instance)
    end = clock.elapsed + min(seconds, clock.left)
    shared = np.zeros(len(instance.weight))
    for part in parts:
        shared[part.targets] += 1
    descent = SubgradientDescent(_bound(instance, parts, instance.weight / np.maximum(shared, 1)), instance.total)
    for iteration in range(ITERATIONS):
        if descent.best.value < goal - instance.margin or descent.step < MIN_STEP or clock.elapsed > end:
            break
        yield Progress(iteration, ITERATIONS, "bounding by parts of the candidates")
        clock.spend(6 * sum(part.matrix.size for part in parts))
        multipliers, seen = descent.current.multipliers, descent.current.seen
        change = descent.move(np.where(multipliers < instance.weight, seen - 1.0, np.maximum(seen - 1.0, 0.0)), goal)
        if change is None:
            break
        descent.record(_bound(instance, parts, np.clip(multipliers - change, 0.0, instance.weight)))
    precise = [replace(part, matrix=part.matrix.astype(np.float64)) for part in parts]
    return _bound(instance, precise, descent.best.multipliers).value


def _parts(instance: Instance) -> list[_Part]:
    """Part the candidates around the first of a greedy choice, each clique where it overlaps most."""
    number = max(1, round(instance.count / SENSORS_PER_PART))
    free = replace(instance, count=number, budget=math.inf, mandatory=np.zeros((0, len(instance)), bool))
    centres = greedy(free, np.zeros(0, np.int64))
    overlap = instance.gains((instance.visible[centres] * instance.weight).T)
    shared = np.zeros((int(instance.clique.max()) + 1, len(centres)))
    np.add.at(shared, instance.clique, overlap)
    nearest = shared.argmax(axis=1)[instance.clique]
    return [_part(instance, np.flatnonzero(nearest == index)) for index in np.unique(nearest)]


def _part(instance: Instance, members: Integer) -> _Part:
    targets = np.flatnonzero(instance.visible[members].any(axis=0))
    excluded = instance.conflict[np.ix_(members, members)] | np.eye(len(members), dtype=bool)
    return _Part(targets, instance.matrix[np.ix_(members, targets)], excluded)


@dataclass(frozen=True, eq=False)
class _PartsBound:
    """L at some multipliers, and how often each target counts in it."""

    value: float
    multipliers: Float
    seen: Float


def _bound(instance: Instance, parts: list[_Part], multipliers: Float) -> _PartsBound:
    found = [part.values(multipliers, instance.count) for part in parts]
    value, numbers = _share_out(np.array([values for values, _ in found]))
    seen = np.zeros(len(multipliers))
    for part, (values, counted), number in zip(parts, found, numbers, strict=True):
        if number == 1:
            seen[part.targets] += counted[0]
        elif number > 1 and values[number] == values[2] * number / 2:
            seen[part.targets] += counted[1] * number / 2
        elif number > 1:
            seen[part.targets] += counted[2]
    return _PartsBound(math.fsum(instance.weight - multipliers) + value, multipliers, seen)


def _share_out(values: Float) -> tuple[float, list[int]]:
    """Return the largest sum of one value of each row, the columns adding up to the last at most, and the columns."""
    best, taken = np.zeros(values.shape[1]), []
    for row in values:
        sums = np.full((len(row), len(row)), -np.inf)
        for number, value in enumerate(row):
            sums[number:, number] = best[: len(row) - number] + value
        taken.append(sums.argmax(axis=1))
        best = sums.max(axis=1)
    left, numbers = len(best) - 1, []
    for choice in reversed(taken):
        numbers.append(int(choice[left]))
        left -= numbers[-1]
    return float(best[-1]), numbers[::-1]
