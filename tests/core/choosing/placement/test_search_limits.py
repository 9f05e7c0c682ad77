"""Limits of counted work, and a search that depends on nothing else."""

import math
import time
from itertools import count

import pytest

from seip_addon.core.base.acceptance import Acceptance
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.search_limits import OPERATIONS_PER_UNIT, SolverLimits, Work
from seip_addon.core.choosing.placement.solver import solve
from tests.builders.placement_problems import hard_problem


def test_work_of_a_part_is_work_of_the_whole():
    whole = Work(10.0)
    part = whole.part(4.0)
    part.spend(3 * OPERATIONS_PER_UNIT)
    assert (part.left, whole.left) == (pytest.approx(1.0, rel=2e-3), pytest.approx(7.0, rel=1e-3))
    assert whole.part(100.0).left == whole.left
    part.end()
    assert part.left == 0.0
    assert whole.left == pytest.approx(7.0, rel=1e-3)


def test_acceptance_leaves_nothing_of_the_whole_and_its_parts():
    acceptance = Acceptance()
    work = SolverLimits(effort=math.inf, acceptance=acceptance).work()
    part = work.part(1.0)
    assert acceptance.searching
    acceptance.accept()
    assert work.left < 0
    assert part.left < 0


@pytest.mark.parametrize("effort", [0.0, -1.0, math.nan])
def test_effort_is_positive(effort):
    with pytest.raises(SeipError, match="give a positive number"):
        SolverLimits(effort=effort)


def test_a_slow_machine_changes_nothing(monkeypatch):
    problem, limits = hard_problem(60, 300), SolverLimits(effort=0.1)
    alone = finish(solve(problem, limits))
    ticks = count(0.0, 1000.0)  # a machine on which any step takes a quarter of an hour
    for clock in ("perf_counter", "process_time", "monotonic"):
        monkeypatch.setattr(time, clock, lambda: next(ticks))
    loaded = finish(solve(problem, limits))
    first, second = ((one.status, one.bound, one.chosen.tolist(), one.notes) for one in (alone, loaded))
    assert first == second
    assert alone.status == "feasible"
