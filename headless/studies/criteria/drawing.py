"""Placements of one type and number: the optimal one, random ones, and some in between."""

import functools
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from seip_addon.core.base.arrays import Integer
from seip_addon.core.base.errors import SeipError
from seip_addon.core.choosing.placement.problem import PlacementProblem

MIN_PLACEMENTS = 4
MAX_TRIES = 20_000  # draws for one placement before an error states that there are no more
SWAPS_PER_PLACEMENT = 20  # draws from which those in between are taken

NEAR = 0.05  # of the targets: how much less than the optimal placement one near it covers at most

RANDOM, BETWEEN = "random", "in between"


def draw_from_pool(
    problem: PlacementProblem, pool: Integer, best: Sequence[Integer], number: int, random: np.random.Generator
) -> list[tuple[str, Integer]]:
    """Draw placements of few poses, so that each pose is scanned once for many placements; return kind and poses.

    Half are drawn uniformly from the sets of poses of a pool, the others spread as those of `draw_placements`, between
    the greedily worst set of the pool and the first of the best ones.

    Parameters
    ----------
    problem : PlacementProblem
        Problem of most coverage for a number of sensors.
    pool : (p,) int64
        Candidates of which placements consist.
    best : sequence of (k,) int64
        Placements that are not drawn again, the one with the largest coverage first.

    Raises
    ------
    SeipError
        The pool has fewer placements.
    """
    assert problem.count is not None  # noqa: S101  # placements of one number of sensors are drawn
    allowed = np.isin(np.arange(len(problem.positions)), np.concatenate([pool, *best]))
    drawing = _Drawing(replace(problem, forbidden=~(problem.allowed & allowed)), problem.count, best, random)
    uniform = drawing.random((number + 1) // 2)
    between = drawing.between(number - len(uniform))
    return [(RANDOM, poses) for poses in uniform] + [(BETWEEN, poses) for poses in between]


class _Drawing:
    """Draws sets of poses, none twice.

    Parameters
    ----------
    optimal : list of (k,) int64
        Are not drawn again; the first is that of coverage.
    """

    def __init__(
        self, problem: PlacementProblem, count: int, optimal: Sequence[Integer], random: np.random.Generator
    ) -> None:
        self._problem, self._count, self._optimal, self._random = problem, count, optimal[0], random
        self._poses = np.flatnonzero(problem.allowed)
        self._taken = {frozenset(one.tolist()) for one in optimal}

    def random(self, number: int) -> list[Integer]:
        """Draw sets uniformly from all that are feasible."""
        return [self._new(lambda: self._random.choice(self._poses, self._count, replace=False)) for _ in range(number)]

    def between(self, number: int) -> list[Integer]:
        """Draw sets whose coverage is spread from that of the worst to that of the optimal, half of them near that."""
        ends = (self._worst(), self._optimal)
        pool: dict[frozenset[int], float] = {}
        for draw in range(SWAPS_PER_PLACEMENT * number):
            swapped = self._new(functools.partial(self._swapped, ends[draw % 2]), keep=False)
            pool[frozenset(swapped.tolist())] = self._coverage(swapped)
        chosen: list[Integer] = []
        low, high = (self._coverage(end) for end in ends)
        few = number // 2
        levels = np.concatenate(
            [np.linspace(low, high, number - few + 2)[1:-1], high - NEAR * np.arange(few) / (few or 1)]
        )
        for level in levels.tolist():
            if not pool:
                return chosen + self.random(number - len(chosen))
            nearest = min(pool, key=lambda poses: (abs(pool[poses] - level), sorted(poses)))
            del pool[nearest]
            self._taken.add(nearest)
            chosen.append(np.array(sorted(nearest), dtype=np.int64))
        return chosen

    def _new(self, draw: Callable[[], Integer], *, keep: bool = True) -> Integer:
        for _ in range(MAX_TRIES):
            poses = np.sort(draw())
            key = frozenset(poses.tolist())
            if key not in self._taken and self._is_feasible(poses):
                if keep:
                    self._taken.add(key)
                return poses
        raise SeipError(
            f"{MAX_TRIES:,} draws found no more placements of {self._count} sensors than {len(self._taken)}: ask for "
            "fewer placements, or allow more positions and heights"
        )

    def _is_feasible(self, poses: Integer) -> bool:
        positions = self._problem.positions[poses]
        return len(set(positions.tolist())) == self._count and bool(
            self._problem.mandatory_groups[:, poses].any(axis=1).all()
        )

    def _swapped(self, poses: Integer) -> Integer:
        """Return poses with one of them replaced by a random one, or with random ones added."""
        kept = self._random.permutation(poses)[: self._count - 1]
        return np.append(kept, self._random.choice(self._poses, self._count - len(kept), replace=False))

    def _worst(self) -> Integer:
        """Return poses that each see something, and each add least to those before them."""
        visible, positions = self._problem.amounts, self._problem.positions
        free = self._poses[visible[self._poses].any(axis=1)]
        seen = np.zeros(visible.shape[1], dtype=bool)
        chosen: list[int] = []
        while len(chosen) < self._count and len(free):
            chosen.append(int(free[np.argmin(np.count_nonzero(visible[free] & ~seen, axis=1))]))
            seen |= visible[chosen[-1]]
            free = free[positions[free] != positions[chosen[-1]]]
        return np.array(chosen, dtype=np.int64)

    def _coverage(self, poses: Integer) -> float:
        return float(self._problem.amounts[poses].any(axis=0).mean())
