"""Searches that a user ends early return the best placement so far with a bound that holds."""

from dataclasses import replace

from headless.studies.benchmark.street_visibility import street_problem

import pytest

from seip_addon.core.acceptance import Acceptance
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.progress import finish


@pytest.fixture(scope="module")
def problem():
    return street_problem(40, 500, count=8)


def test_nothing_is_accepted_before_the_search_begins(problem):
    acceptance = Acceptance()
    assert not acceptance.searching
    steps = solve(problem, SolverLimits(acceptance=acceptance))
    next(steps)
    assert acceptance.searching
    assert not acceptance.accepted
    steps.close()


@pytest.mark.parametrize("after", [1, 10, 60])
def test_an_accepted_search_ends_with_what_it_has(problem, after):
    acceptance = Acceptance()
    steps, placement, number = solve(problem, SolverLimits(effort=1e6, acceptance=acceptance)), None, 0
    while placement is None:
        try:
            next(steps)
        except StopIteration as end:
            placement = end.value
        number += 1
        if number == after:
            acceptance.accept()
    assert number < after + 200
    assert placement.status == "feasible"
    assert any(note.startswith("the search ended before this placement was proven optimal") for note in placement.notes)
    longer = finish(solve(problem, SolverLimits(effort=2.0)))
    assert placement.objective <= longer.bound
    assert longer.objective <= placement.bound
    assert placement.objective == problem.covered(placement.chosen)


def test_acceptance_does_not_change_what_limits_are_equal(problem):
    limits = SolverLimits(effort=0.5)
    with_acceptance = replace(limits, acceptance=Acceptance())
    assert with_acceptance == limits
    one, other = finish(solve(problem, limits)), finish(solve(problem, with_acceptance))
    assert (one.chosen == other.chosen).all()
    assert one.bound == other.bound
