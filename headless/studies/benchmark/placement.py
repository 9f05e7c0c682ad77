"""Time and gap of placement methods: ours, greedy, local search, and plain integer programs.

The alternatives solve only the plain problem: a given number of sensors, at most one at each position.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from headless.studies.benchmark.resource_usage import Expense, peak_memory

import numpy as np
import pulp
from pulp.apis.coin_api import pulp_cbc_path

from seip_addon.core.base.arrays import Boolean, Integer
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.problem import PlacementProblem
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.placement.solver import solve

Solution = tuple[Integer | None, float]
"""Chosen poses (k,), or None, and the upper bound on the covered weight that the method proves, or infinity."""


@dataclass(frozen=True, eq=False)
class SolverRun:
    """Run of one method on one instance.

    Parameters
    ----------
    memory : float or None, MB
    objective : float
        Covered weight; 0 if no placement was found.
    bound : float
        Upper bound that the method proves itself; infinite if it gives none.
    best_bound : float
        Lowest bound that any method proved for the instance.
    """

    instance: str
    method: str
    expense: Expense
    memory: float | None
    objective: float
    bound: float
    best_bound: float

    @property
    def gap(self) -> float:
        """Gap to the best bound, as a share of the bound."""
        return max(0.0, 1 - self.objective / self.best_bound)

    @property
    def own_gap(self) -> float:
        """Gap that the method proves itself; infinite if it gives no bound."""
        return max(0.0, 1 - self.objective / self.bound) if math.isfinite(self.bound) else math.inf

    @property
    def proven(self) -> bool:
        """Whether the method itself proves that its placement is optimal."""
        return self.own_gap < 1e-6


def ours(problem: PlacementProblem, effort: float) -> Solution:
    """Solve by the project's own method, within units of counted work."""
    placement = finish(solve(problem, SolverLimits(effort=effort)))
    return placement.chosen, placement.bound


def lazy_greedy(problem: PlacementProblem, _: float) -> Solution:
    """Add the pose of the largest gain; recompute a gain only if the old one could be the largest (Minoux 1978)."""
    # Coverage is submodular: a pose's gain never grows as poses are added. An outdated gain is therefore an upper
    # bound, and a pose whose gain is up to date and on top of the heap is the greedy choice.
    unseen: Boolean = np.ones(problem.amounts.shape[1], dtype=np.bool_)
    gains = problem.amounts @ problem.weights
    heap = [(-gain, pose, 0) for pose, gain in enumerate(gains.tolist())]
    heapq.heapify(heap)
    chosen: list[int] = []
    while heap and len(chosen) < _count(problem):
        gain, pose, known_at = heapq.heappop(heap)
        if problem.positions[pose] in problem.positions[chosen]:
            continue
        if known_at < len(chosen):
            gain = -float(problem.weights[problem.amounts[pose] & unseen].sum())
            heapq.heappush(heap, (gain, pose, len(chosen)))
        else:
            chosen.append(pose)
            unseen &= ~problem.amounts[pose]
    return np.array(chosen), math.inf


def local_search(problem: PlacementProblem, limit: float) -> Solution:
    """Improve the greedy choice by the best swap of one pose for another, until none helps (Teitz and Bart 1968)."""
    chosen, _ = lazy_greedy(problem, limit)
    while chosen is not None:
        times = problem.amounts[chosen].sum(axis=0)
        best, better = _covered(problem, chosen), None
        for gone in chosen:
            rest = chosen[chosen != gone]
            left = (times - problem.amounts[gone]) == 0
            gain = problem.amounts[:, left] @ problem.weights[left]
            gain[np.isin(problem.positions, problem.positions[rest])] = -1.0
            new = int(np.argmax(gain))
            value = _covered(problem, np.append(rest, new))
            if value > best + 1e-9:
                best, better = value, np.append(rest, new)
        if better is None:
            break
        chosen = better
    return chosen, math.inf


def plain_cbc(problem: PlacementProblem, seconds: float) -> Solution:
    """Solve the plain program with CBC through PuLP."""
    return _solve_plain(problem, pulp.COIN_CMD(path=pulp_cbc_path, msg=False, timeLimit=seconds, gapRel=0.0, threads=1))


def plain_highs(problem: PlacementProblem, seconds: float) -> Solution:
    """Solve the plain program with HiGHS through PuLP."""
    return _solve_plain(problem, pulp.HiGHS(msg=False, timeLimit=seconds, gapRel=0.0, threads=1))


METHODS: dict[str, Callable[[PlacementProblem, float], Solution]] = {
    "greedy": lazy_greedy,
    "local search": local_search,
    "PuLP + CBC": plain_cbc,
    "PuLP + HiGHS": plain_highs,
    "ours": ours,
}
"""Methods by name. Their limit is in seconds; for ours, in units of counted work of about a second."""


def compare(name: str, problem: PlacementProblem, methods: Sequence[str], limit: float) -> list[SolverRun]:
    """Solve an instance by several methods in turn, each with the same limit.

    Parameters
    ----------
    name : str
        Name of the instance.
    methods : sequence of str
        Keys of `METHODS`.
    limit : float
        Seconds, or units of counted work for ours.
    """
    rows = []
    for method in methods:
        expense = Expense()
        (chosen, bound), memory = peak_memory(partial(expense.time, partial(METHODS[method], problem, limit)))
        rows.append((method, expense, memory, 0.0 if chosen is None else _covered(problem, chosen), bound))
    least = min(bound for *_, bound in rows)
    best_bound = least if math.isfinite(least) else float(problem.weights.sum())
    return [SolverRun(name, *row, best_bound) for row in rows]


def _solve_plain(problem: PlacementProblem, solver: Any) -> Solution:  # noqa: ANN401 - PuLP's solvers are untyped
    """Solve the textbook integer program: a binary variable x for each pose and y for each target."""
    model = pulp.LpProblem("plain", pulp.LpMaximize)
    x = [model.add_variable(f"x{i}", 0, 1, pulp.LpBinary) for i in range(len(problem.amounts))]
    y = [model.add_variable(f"y{j}", 0, 1, pulp.LpBinary) for j in range(len(problem.weights))]
    model.setObjective(pulp.lpDot(problem.weights.tolist(), y))
    for y_j, column in zip(y, problem.amounts.T, strict=True):
        model += y_j <= pulp.lpSum(x[i] for i in np.flatnonzero(column))
    model += pulp.lpSum(x) <= _count(problem)
    for position in np.unique(problem.positions):
        model += pulp.lpSum(x[i] for i in np.flatnonzero(problem.positions == position)) <= 1
    model.solve(solver)
    # PuLP reports a solution at the time limit as optimal, too.
    if model.sol_status not in (pulp.LpSolutionOptimal, pulp.LpSolutionIntegerFeasible):
        return None, math.inf
    chosen = np.flatnonzero([round(variable.value() or 0.0) for variable in x])
    proven = model.sol_status == pulp.LpSolutionOptimal
    return chosen, float(pulp.value(model.objective)) if proven else math.inf


def _covered(problem: PlacementProblem, chosen: Integer) -> float:
    seen: Boolean = problem.amounts[chosen].any(axis=0)
    return float(problem.weights[seen].sum())


def _count(problem: PlacementProblem) -> int:
    if problem.count is None:
        raise ValueError("the benchmark's methods need the number of sensors: set `count`")
    return problem.count
