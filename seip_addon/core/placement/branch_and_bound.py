"""Branch and bound on what each sensor adds: proves small numbers of sensors that linear programs leave open.

A placement is built in greedy order: each sensor adds no more than the one
before it, because coverage is submodular. At a node with k sensors still to
come the best completion adds at most the sum of the k largest gains; these
sums fall along the sorted candidates, so all children below the first that
falls short are cut at once (cf. Nemhauser and Wolsey 1981 on maximising
submodular set functions). The gains of all children come from one matrix
product. Where rings of beams overlap a little everywhere the relaxed integer
program is weak and this bound is strong.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Boolean, Integer
from ..progress import Progress
from .clock import Clock
from .instance import SLACK, Instance

LARGEST = 30_000_000
"""Entries of V up to which the search keeps V as numbers: 120 MB, or twice that where weights are uneven."""

MOST_SENSORS = 8
"""Beyond so many sensors to choose the branches are too many to hope for an end."""

Numbers = NDArray[np.floating[Any]]


@dataclass(frozen=True, eq=False)
class Found:
    """What a search found.

    Parameters
    ----------
    placements : tuple of (k,) int64
        Sorted candidates of each placement that reaches the goal.
    finished : bool
        Whether the search saw everything: no other placement reaches the goal.
    """

    placements: tuple[Integer, ...]
    finished: bool


@dataclass(frozen=True, eq=False)
class _Node:
    """Sensors chosen so far and who may follow, largest gain first.

    Parameters
    ----------
    chosen : tuple of int
    value : float
        What they cover, in units of the search.
    followers : (n,) int64
    gains : (n,) float
        What each follower would add.
    """

    chosen: tuple[int, ...]
    value: float
    followers: Integer
    gains: Numbers


def is_worthwhile(instance: Instance, candidates: Integer) -> bool:
    """Return whether a search among some candidates of an instance may end in useful time and memory."""
    return instance.count <= MOST_SENSORS and len(candidates) * len(instance.weight) <= LARGEST


def best_reaching(instance: Instance, goal: float, clock: Clock, seconds: float) -> Generator[Progress, None, Found]:
    """Find a placement of largest coverage among those that cover at least ``goal``.

    Parameters
    ----------
    instance : Instance
    goal : float
        Scaled weight to be covered at least.
    clock : Clock
    seconds : float
        Longest time to search.

    Yields
    ------
    Progress

    Returns
    -------
    Found
        One placement, or none: then, if finished, no placement covers the goal.
    """
    return (yield from _Search(instance, goal, most=None).run(clock, seconds))


def all_reaching(
    instance: Instance, goal: float, most: int, clock: Clock, seconds: float
) -> Generator[Progress, None, Found]:
    """List the placements that cover at least ``goal`` and cease to without any one of their later sensors.

    Parameters
    ----------
    instance : Instance
    goal : float
        Scaled weight to be covered at least.
    most : int
        The search stops, unfinished, beyond so many.
    clock : Clock
    seconds : float
        Longest time to search.

    Yields
    ------
    Progress

    Returns
    -------
    Found
    """
    return (yield from _Search(instance, goal, most=most).run(clock, seconds))


class _Search:
    """One search: ``most`` is None where only the best placement is wanted."""

    def __init__(self, instance: Instance, goal: float, most: int | None) -> None:
        self.instance = instance
        self.most = most
        self.found: list[Integer] = []
        whole = instance.step > 2 * SLACK
        # Counts of targets are exact in single precision.
        self.unit = instance.step if whole else 1.0
        exact = whole and instance.total / self.unit < 2**23
        self.weight = (np.rint(instance.weight / self.unit) if whole else instance.weight).astype(
            np.float32 if exact else np.float64
        )
        self.matrix = instance.visible.astype(self.weight.dtype)
        self.slack = 0.25 if whole else SLACK
        self.goal = instance.attainable(goal) / self.unit - self.slack

    def run(self, clock: Clock, seconds: float) -> Generator[Progress, None, Found]:
        """Search depth first until all is seen, too many are found, or the time is up."""
        end = min(clock.elapsed + seconds, clock.elapsed + clock.left)
        everyone = np.arange(len(self.instance))
        root = self._sorted((), 0.0, everyone, self.matrix @ self.weight)
        stack = [root]
        nodes = 0
        while stack:
            if clock.elapsed > end or (self.most is not None and len(self.found) > self.most):
                return Found(tuple(self.found), finished=False)
            if nodes % 64 == 0:
                yield Progress(0, 1, f"searching placements, {nodes:,} branches so far")
            nodes += 1
            stack += reversed(self._expand(stack.pop()))
        return Found(tuple(self.found), finished=True)

    def _expand(self, node: _Node) -> list[_Node]:
        """Return the children of a node that can still reach the goal; take those that do."""
        left = self.instance.count - len(node.chosen)
        sums = np.concatenate(([0.0], np.cumsum(node.gains, dtype=np.float64), np.full(left, np.sum(node.gains))))
        reach = node.value + sums[left : left + len(node.gains)] - sums[: len(node.gains)]
        children = int(np.count_nonzero(reach >= self.goal))
        if children == 0:
            return []
        if left == 1:
            for candidate, gain in zip(node.followers[:children], node.gains[:children], strict=True):
                if node.value + gain < self.goal:  # another leaf has raised it
                    break
                self._take((*node.chosen, int(candidate)), node.value + float(gain))
            return []
        # A follower matters only where it reaches the goal together with the largest gains.
        useful = int(np.count_nonzero(node.value + sums[left - 1] + node.gains >= self.goal))
        followers, gains = node.followers[:useful], node.gains[:useful]
        rest = self.weight * ~self.instance.visible[list(node.chosen)].any(axis=0)
        open_targets = np.flatnonzero(rest)
        matrix = self.matrix[np.ix_(followers, open_targets)]
        overlap = (matrix[:children] * rest[open_targets]) @ matrix.T
        kept = []
        for row in range(min(children, useful)):
            chosen = (*node.chosen, int(followers[row]))
            value = node.value + float(gains[row])
            if value >= self.goal and self._take(chosen, value):
                continue
            after = slice(row + 1, useful)
            may = self._compatible(chosen, followers[after])
            kept.append(self._sorted(chosen, value, followers[after][may], (gains[after] - overlap[row, after])[may]))
        return kept

    def _sorted(self, chosen: tuple[int, ...], value: float, followers: Integer, gains: Numbers) -> _Node:
        order = np.argsort(-gains, kind="stable")
        return _Node(chosen, value, followers[order], np.maximum(gains[order], 0.0))

    def _compatible(self, chosen: tuple[int, ...], followers: Integer) -> Boolean:
        """Which candidates may join: no conflict with the last chosen, and still affordable."""
        instance = self.instance
        may: Boolean = ~instance.conflict[chosen[-1], followers]
        if np.isfinite(instance.budget):
            may &= instance.affordable(instance.price[list(chosen)].sum() + instance.price[followers])
        return may

    def _take(self, chosen: tuple[int, ...], value: float) -> bool:
        """Take a placement that reaches the goal, if it meets every constraint; say whether none below it is wanted."""
        placement = np.sort(np.array(chosen, dtype=np.int64))
        if value < self.goal or not self.instance.feasible(placement):
            return False
        if self.most is None:
            self.found = [placement]
            self.goal = value + 2 * self.slack
            return False
        self.found.append(placement)
        return True
