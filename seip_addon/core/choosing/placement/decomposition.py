r"""Upper bounds on coverage by Lagrangian decomposition of the candidates into parts, for many sensors.

The linear relaxation is weak where sensors overlap. Here the candidates are partitioned, and only targets that several
parts see are relaxed: with multipliers :math:`0 \le \lambda_j \le w_j`,

.. math::
    L(\lambda) = \sum_j (w_j - \lambda_j) + \max_{\sum_d m_d \le N} \sum_d F_d(m_d),

where :math:`F_d(m)` bounds the weight :math:`\lambda` that m sensors of part d cover: the optimum for one and two
sensors; for more the smaller of :math:`m/2` times the optimum for two (coverage is submodular) and the weight of all
targets of the part. This is Lagrangian decomposition (Guignard and Kim 1987) with overlaps within a part kept in its
subproblem.
"""

import math
from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Boolean, Float, Integer
from ...progress import Progress
from .bounds import MIN_STEP, SubgradientDescent
from .greedy import greedy
from .reduced_problem import Instance, Numbers
from .search_limits import Clock

MAX_ITERATIONS = 2000

SENSORS_PER_PART = 1.8  # sensors of a placement for each part; about two, as the overlap of pairs is computed exactly


@dataclass(frozen=True, eq=False)
class _Part:
    """Part of the partition: n candidates, and the s targets that any of them sees.

    Parameters
    ----------
    targets : (s,) int64
        Indices of these targets in the instance.
    matrix : (n, s) float
        1 if a candidate sees a target, otherwise 0.
    excluded : (n, n) bool
        Pairs that cannot be chosen together, each candidate with itself included.
    """

    targets: Integer
    matrix: Numbers
    excluded: Boolean

    def values(self, multipliers: Float, count: int) -> tuple[Float, list[Float]]:
        """Return F(0) … F(count), and the targets (s,) seen by the best one, the best two and all, as 0 or 1."""
        weight = multipliers[self.targets].astype(self.matrix.dtype)
        # F(1) is the largest entry. The best pair is found without listing all pairs: the best partner of the best
        # single candidate sets a limit that most candidates cannot reach in any pair.
        covered = self.matrix @ weight
        first = int(np.argmax(covered))
        gain = np.where(self.excluded[first], 0.0, covered - self.matrix @ (weight * self.matrix[first]))
        # A pair covers at most the sum of what its two candidates cover. If one of them covers less than the largest
        # gain on top of `first`, and the other at most what `first` covers, the pair is no better than that one.
        rows = np.flatnonzero(covered >= gain.max())
        pairs = covered[rows, None] + covered[rows] - (self.matrix[rows] * weight) @ self.matrix[rows].T
        pairs[self.excluded[np.ix_(rows, rows)]] = 0.0
        one, other = np.unravel_index(int(np.argmax(pairs)), pairs.shape)
        # where no pair is allowed, all of these are zero, and one sensor is the best choice of up to two
        best_two = max(float(pairs[one, other]), float(covered[first]))
        seen_by_two = np.maximum(self.matrix[rows[one]], self.matrix[rows[other]])
        if best_two == covered[first]:
            seen_by_two = self.matrix[first]
        # For m > 2: coverage is submodular, so m sensors cover at most m/2 times the mean of their pairs, which is at
        # most the best pair; nor can they cover more than all targets of the part.
        number = np.arange(count + 1)
        value = np.minimum(best_two * np.maximum(number, 2) / 2, float(weight.sum(dtype=np.float64)))
        value[:2] = 0.0, covered[first]
        return value, [self.matrix[first], seen_by_two, np.ones(len(self.targets))]


def decomposition_bound(
    instance: Instance, goal: float, clock: Clock, seconds: float
) -> Generator[Progress, None, float]:
    """Return an upper bound on the covered weight of placements, without the budget and the mandatory groups.

    Parameters
    ----------
    goal : float
        Covered weight below which the descent may stop.
    seconds : float
        Maximum time, in units of work if the clock counts these.
    """
    parts = _partition(instance)
    end = clock.elapsed + min(seconds, clock.left)
    # each target's weight begins divided equally among the parts that see it
    parts_seeing = np.zeros(len(instance.weight))
    for part in parts:
        parts_seeing[part.targets] += 1
    start = _bound(instance, parts, instance.weight / np.maximum(parts_seeing, 1))
    descent = SubgradientDescent(start, instance.total)
    for _ in range(MAX_ITERATIONS):
        if descent.best.value < goal - instance.margin or descent.step < MIN_STEP or clock.elapsed > end:
            break
        yield Progress(0, 0, "bounding by parts of the candidates")
        clock.spend(6 * sum(part.matrix.size for part in parts))
        # The slope of L in a multiplier is how often the parts count the target, less one. Where a multiplier is at its
        # upper limit w, a negative slope would raise it further: it is set to zero there.
        multipliers, seen = descent.current.multipliers, descent.current.seen
        change = descent.move(np.where(multipliers < instance.weight, seen - 1.0, np.maximum(seen - 1.0, 0.0)), goal)
        if change is None:
            break
        descent.record(_bound(instance, parts, np.clip(multipliers - change, 0.0, instance.weight)))
    # steps may use single precision, but the bound that is returned must be safe: it is computed again in double
    precise = [replace(part, matrix=part.matrix.astype(np.float64)) for part in parts]
    return _bound(instance, precise, descent.best.multipliers).value


def _partition(instance: Instance) -> list[_Part]:
    """Assign each clique of candidates to the greedily chosen candidate that it overlaps most."""
    # Overlaps within a part are computed exactly for pairs, those between parts are relaxed: candidates that see the
    # same targets should share a part. Greedy choices spread over the targets and serve as centres. Cliques stay whole,
    # so that the parts keep the rule of one sensor in each. Any partition gives a valid bound.
    number = max(1, round(instance.count / SENSORS_PER_PART))
    unconstrained = replace(instance, count=number, budget=math.inf, mandatory=np.zeros((0, len(instance)), bool))
    centres = greedy(unconstrained, np.zeros(0, np.int64))
    overlap = instance.gains((instance.visible[centres] * instance.weight).T)
    clique_overlap = np.zeros((int(instance.clique.max()) + 1, len(centres)))
    np.add.at(clique_overlap, instance.clique, overlap)
    nearest = clique_overlap.argmax(axis=1)[instance.clique]
    return [_part(instance, np.flatnonzero(nearest == index)) for index in np.unique(nearest)]


def _part(instance: Instance, members: Integer) -> _Part:
    targets = np.flatnonzero(instance.visible[members].any(axis=0))
    excluded = instance.conflict[np.ix_(members, members)] | np.eye(len(members), dtype=bool)
    return _Part(targets, instance.matrix[np.ix_(members, targets)], excluded)


@dataclass(frozen=True, eq=False)
class _PartsBound:
    """The bound L(λ), its multipliers λ, and the number of times each target counts in Σ F; arrays (t,) float64."""

    value: float
    multipliers: Float
    seen: Float


def _bound(instance: Instance, parts: list[_Part], multipliers: Float) -> _PartsBound:
    """Return L(λ) for given multipliers λ."""
    found = [part.values(multipliers, instance.count) for part in parts]
    value, counts = _allocate(np.array([values for values, _ in found]))
    # Number of times that each target counts in the sum, which is the slope of that sum in its multiplier: once for the
    # best single candidate, m/2 times for a value that comes from the best pair, once for all targets of a part.
    seen = np.zeros(len(multipliers))
    for part, (values, (by_one, by_two, by_all)), count in zip(parts, found, counts, strict=True):
        if count == 1:
            seen[part.targets] += by_one
        elif count > 1:
            limited_by_pairs = values[count] == values[2] * count / 2
            seen[part.targets] += by_two * count / 2 if limited_by_pairs else by_all
    return _PartsBound(math.fsum(instance.weight - multipliers) + value, multipliers, seen)


def _allocate(values: Float) -> tuple[float, list[int]]:
    """Return the largest total value of N sensors over all parts, and the number in each, by dynamic programming.

    ``values`` (parts, N + 1) float64 has the value of 0 … N sensors in each part.
    """
    # best[n]: largest value of n sensors over the parts so far. sums[n, m]: the same when this part has m of the n.
    best, choices = np.zeros(values.shape[1]), []
    for row in values:
        sums = np.full((len(row), len(row)), -np.inf)
        for count, value in enumerate(row):
            sums[count:, count] = best[: len(row) - count] + value
        choices.append(sums.argmax(axis=1))
        best = sums.max(axis=1)
    # backwards through the parts: the number in each, given the number of sensors left for it and those before it
    left, counts = len(best) - 1, []
    for choice in reversed(choices):
        counts.append(int(choice[left]))
        left -= counts[-1]
    return float(best[-1]), counts[::-1]
