"""Time and gap of placement methods over a set of instances."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from headless.studies.benchmark.baselines import BASELINES
from headless.studies.benchmark.resource_usage import Expense, peak_memory

from seip_addon.core.choosing.placement.problem import PlacementProblem


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
    way: str
    expense: Expense
    memory: float | None
    objective: float
    bound: float
    best_bound: float
    note: str

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


def compare(name: str, problem: PlacementProblem, ways: Sequence[str], limit: float) -> list[SolverRun]:
    """Solve an instance by several methods in turn, each with the same limit.

    Parameters
    ----------
    name : str
        Name of the instance.
    ways : sequence of str
        Keys of `BASELINES`.
    limit : float
        Seconds, or units of counted work for ours.

    Returns
    -------
    list of SolverRun
    """
    rows = []
    for way in ways:
        expense = Expense()
        found, memory = peak_memory(partial(expense.time, partial(BASELINES[way], problem, limit)))
        seen = problem.amounts[found.chosen].any(axis=0) if found.chosen is not None else problem.weights < 0
        objective = float(problem.weights[seen].sum())
        rows.append((way, expense, memory, objective, found))
    least = min((found.bound for *_, found in rows), default=math.inf)
    best = least if math.isfinite(least) else float(problem.weights.sum())
    return [
        SolverRun(name, way, expense, memory, objective, found.bound, best, found.note)
        for way, expense, memory, objective, found in rows
    ]
