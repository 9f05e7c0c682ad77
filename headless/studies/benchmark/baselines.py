"""Alternative placement methods, as baselines: spopt, plain integer programs, simple greedy.

They solve only the plain problem: a given number of sensors, at most one at each position.
"""

from __future__ import annotations

import heapq
import importlib
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pulp
from pulp.apis.coin_api import pulp_cbc_path

from seip_addon.core.arrays import Boolean, Integer
from seip_addon.core.choosing.placement.problem import PlacementProblem
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.placement.solver import solve, solve_greedy
from seip_addon.core.progress import finish


@dataclass(frozen=True, eq=False)
class Found:
    """Result of a method within its limit.

    Parameters
    ----------
    chosen : (k,) int64 or None
        Chosen poses; None if no placement was found.
    bound : float
        Upper bound on the covered weight; infinite if the method gives none.
    note : str
        Why the result does not answer the problem, or "".
    """

    chosen: Integer | None
    bound: float = np.inf
    note: str = ""


def ours(problem: PlacementProblem, effort: float) -> Found:
    """Solve by the project's own method, within units of counted work."""
    placement = finish(solve(problem, SolverLimits(effort=effort)))
    return Found(placement.chosen, placement.bound)


def plain_greedy(problem: PlacementProblem, _: float) -> Found:
    """Add the pose with the largest gain until the count is reached."""
    return Found(solve_greedy(problem).chosen)


def lazy_greedy(problem: PlacementProblem, _: float) -> Found:
    """As greedy, but recompute a gain only if the old one could still be the largest (Minoux 1978)."""
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
    return Found(np.array(chosen))


def local_search(problem: PlacementProblem, seconds: float) -> Found:
    """Improve the greedy choice by the best swap of one pose for another, until none helps (Teitz and Bart 1968)."""
    chosen = lazy_greedy(problem, seconds).chosen
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
    return Found(chosen)


def rounded_relaxation(problem: PlacementProblem, seconds: float) -> Found:
    """Solve the linear relaxation with HiGHS and take the poses of the largest shares."""
    model, x = _plain_program(problem, pulp.LpContinuous)
    model.solve(pulp.HiGHS(msg=False, timeLimit=seconds, threads=1))
    if model.sol_status != pulp.LpSolutionOptimal:
        return Found(None, note="the relaxation took too long")
    share = np.array([variable.value() for variable in x])
    chosen: list[int] = []
    for pose in np.argsort(-share, kind="stable").tolist():
        if len(chosen) == _count(problem):
            break
        if problem.positions[pose] not in problem.positions[chosen]:
            chosen.append(pose)
    return Found(np.array(chosen), float(pulp.value(model.objective)))


def plain_cbc(problem: PlacementProblem, seconds: float) -> Found:
    """Solve the plain program with CBC through PuLP."""
    model, x = _plain_program(problem, pulp.LpBinary)
    model.solve(pulp.COIN_CMD(path=pulp_cbc_path, msg=False, timeLimit=seconds, gapRel=0.0, threads=1))
    return _outcome(model, x)


def plain_highs(problem: PlacementProblem, seconds: float) -> Found:
    """Solve the plain program with HiGHS through PuLP."""
    model, x = _plain_program(problem, pulp.LpBinary)
    model.solve(pulp.HiGHS(msg=False, timeLimit=seconds, gapRel=0.0, threads=1))
    return _outcome(model, x)


def spopt_mclp(problem: PlacementProblem, seconds: float) -> Found:
    """Solve with spopt's MCLP and HiGHS; spopt has no constraint of one sensor per position."""
    from spopt.locate import MCLP  # noqa: PLC0415 - of the group 'benchmark', which need not be installed

    hidden = 1.0 - problem.amounts.T
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # spopt makes variables as PuLP 4 no longer will
        mclp = MCLP.from_cost_matrix(hidden, problem.weights, service_radius=0.5, p_facilities=_count(problem))
        try:
            mclp.solve(pulp.HiGHS(msg=False, timeLimit=seconds, gapRel=0.0, threads=1))
        except RuntimeError:
            return Found(None, note="raises at the time limit")
    found = _outcome(mclp.problem, mclp.fac_vars)
    if found.chosen is not None and len(np.unique(problem.positions[found.chosen])) < len(found.chosen):
        return Found(None, found.bound, "puts two sensors at one position")
    return found


BASELINES: dict[str, Callable[[PlacementProblem, float], Found]] = {
    "greedy": plain_greedy,
    "lazy greedy": lazy_greedy,
    "local search": local_search,
    "LP rounding": rounded_relaxation,
    "PuLP + CBC": plain_cbc,
    "PuLP + HiGHS": plain_highs,
    "spopt MCLP": spopt_mclp,
    "ours": ours,
}
"""Methods by name. Their limit is in seconds; for ours, in units of counted work of about a second."""


def can_run(rival: str) -> bool:
    """Return whether the packages of a method are installed, and load them, so that loading is not measured."""
    if rival != "spopt MCLP":
        return True
    try:
        importlib.import_module("spopt.locate")
    except ModuleNotFoundError:
        return False
    return True


def _plain_program(problem: PlacementProblem, category: str) -> tuple[Any, list[Any]]:
    """Return the textbook integer program and its variables x, one for each pose."""
    model = pulp.LpProblem("plain", pulp.LpMaximize)
    x = [model.add_variable(f"x{i}", 0, 1, category) for i in range(len(problem.amounts))]
    y = [model.add_variable(f"y{j}", 0, 1, category) for j in range(len(problem.weights))]
    model.setObjective(pulp.lpDot(problem.weights.tolist(), y))
    for y_j, column in zip(y, problem.amounts.T, strict=True):
        model += y_j <= pulp.lpSum(x[i] for i in np.flatnonzero(column))
    model += pulp.lpSum(x) <= _count(problem)
    for position in np.unique(problem.positions):
        model += pulp.lpSum(x[i] for i in np.flatnonzero(problem.positions == position)) <= 1
    return model, x


def _outcome(model: Any, x: list[Any]) -> Found:  # noqa: ANN401 - PuLP's programs are untyped
    """Read the result of a solved program; PuLP reports a solution at the time limit as optimal, too."""
    if model.sol_status not in (pulp.LpSolutionOptimal, pulp.LpSolutionIntegerFeasible):
        return Found(None, note="nothing found in time")
    chosen = np.flatnonzero([round(variable.value() or 0.0) for variable in x])
    proven = model.sol_status == pulp.LpSolutionOptimal
    return Found(chosen, float(pulp.value(model.objective)) if proven else np.inf)


def _covered(problem: PlacementProblem, chosen: Integer) -> float:
    seen: Boolean = problem.amounts[chosen].any(axis=0)
    return float(problem.weights[seen].sum())


def _count(problem: PlacementProblem) -> int:
    if problem.count is None:
        raise ValueError("the benchmark's methods need the number of sensors: set `count`")
    return problem.count
