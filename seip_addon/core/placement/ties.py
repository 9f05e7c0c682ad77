"""The canonical one among equally good placements.

Stages, each within the optima of those before: largest coverage, fewest
sensors, lowest price, largest doubly covered weight, and first in the
canonical order of candidates.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from typing import Any

import numpy as np

from ..arrays import Integer
from ..progress import Progress
from .bounds import can_reach, lagrangian_bound
from .clock import Clock
from .instance import SLACK, Instance
from .integer_program import CoverProgram
from .problem import TIE

BLOCK = 10
"""Candidates whose order is settled by one program: powers of two up to 512 stay far above all tolerances."""


def canonical_optimum(
    instance: Instance, chosen: Integer, solver: str, clock: Clock
) -> Generator[Progress, None, tuple[Integer, bool]]:
    """Return the canonical one of the placements that cover as much as an optimal one.

    Parameters
    ----------
    instance : Instance
    chosen : (k,) int64
        An optimal placement.
    solver : str
    clock : Clock

    Yields
    ------
    Progress

    Returns
    -------
    (k,) int64
        The canonical optimum, or the best so far where the time was too short.
    bool
        Whether every stage came to its end.
    """
    goal = instance.covered(chosen)
    chosen, settled = yield from _fewest(instance, chosen, goal, solver, clock)
    if not settled:
        return chosen, False
    same_number = replace(instance, count=len(chosen))
    bound = yield from lagrangian_bound(same_number, goal, clock)
    keep = np.union1d(can_reach(same_number, bound, goal), chosen)
    yield Progress(0, 1, f"breaking ties among {len(keep)} candidates")
    part = same_number.part(keep)
    stages = _Stages(part, goal, np.searchsorted(keep, chosen), solver, clock)
    _break_ties(part, stages)
    return keep[stages.chosen], stages.settled


def _fewest(
    instance: Instance, chosen: Integer, goal: float, solver: str, clock: Clock
) -> Generator[Progress, None, tuple[Integer, bool]]:
    fewer = replace(instance, count=len(chosen) - 1)
    if fewer.count == 0:
        return chosen, True
    bound = yield from lagrangian_bound(fewer, goal, clock)
    keep = can_reach(fewer, bound, goal)
    if bound.value < goal - SLACK or len(keep) == 0:
        return chosen, True
    yield Progress(0, 1, f"looking for fewer sensors among {len(keep)} candidates")
    program = CoverProgram(fewer.part(keep))
    program.require(program.covered >= goal - SLACK)
    outcome = program.maximise(-1 * program.number, solver, clock.left)
    return (chosen if outcome.chosen is None else keep[outcome.chosen]), outcome.finished


class _Stages:
    """One program, solved for one objective after another; a stage that runs out of time ends them all."""

    def __init__(self, part: Instance, goal: float, chosen: Integer, solver: str, clock: Clock) -> None:
        self.program = CoverProgram(part)
        self.program.require(self.program.covered >= goal - SLACK)
        self.chosen = chosen
        self.settled = True
        self._solver = solver
        self._clock = clock

    def maximise(self, objective: Any) -> None:  # noqa: ANN401 -- PuLP's expressions are untyped
        if self.settled:
            outcome = self.program.maximise(objective, self._solver, self._clock.left)
            self.settled = outcome.finished and outcome.chosen is not None
            if self.settled and outcome.chosen is not None:
                self.chosen = outcome.chosen


def _break_ties(part: Instance, stages: _Stages) -> None:
    if len(part) == len(stages.chosen):
        return
    program, first = stages.program, stages.chosen
    stages.maximise(-1 * program.number_among(first))
    if np.array_equal(stages.chosen, first):
        return  # no other placement is as good
    if np.ptp(part.price) > 0:
        stages.maximise(-1 * program.price)
        price = float(part.price[stages.chosen].sum())
        program.require(program.price <= price * program.price_scale * (1 + TIE))
    if len(first) > 1:
        stages.maximise(program.doubly_covered)
        program.require(program.doubly_covered >= part.doubly(stages.chosen) - SLACK)
    _first_in_order(part, stages)


def _first_in_order(part: Instance, stages: _Stages) -> None:
    """Maximise the indicator of the choice as a binary number, a block of digits at a time."""
    for block in np.array_split(np.arange(len(part)), range(BLOCK, len(part), BLOCK)):
        stages.maximise(stages.program.number_among(block, 2.0 ** np.arange(len(block))[::-1]))
        for candidate in block:
            stages.program.require(stages.program.x[candidate] == int(candidate in stages.chosen))
        if stages.chosen.max(initial=-1) <= block[-1]:
            return
