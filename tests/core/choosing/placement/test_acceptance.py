"""Searches that a user ends early return the best placement so far with a bound that holds."""

from headless.studies.benchmark.street_visibility import street_problem

import pytest

from seip_addon.core.acceptance import Acceptance
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.progress import finish


@pytest.fixture(scope="module")
def problem():
    return street_problem(30, 300, count=6)


@pytest.mark.parametrize("after", [1, 10])
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
    longer = finish(solve(problem, SolverLimits(effort=0.3)))
    assert placement.objective <= longer.bound
    assert longer.objective <= placement.bound
    assert placement.objective == problem.covered(placement.chosen)
