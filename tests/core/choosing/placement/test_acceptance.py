"""Searches that may end at any step: what their reports show, and the best placement so far with its bound."""

import re

from headless.studies.benchmark.street_visibility import street_problem

import pytest

from seip_addon.core.acceptance import Acceptance
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.progress import Pace, finish


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


def times_left(steps):
    """Return the reports after which a time would be shown, one second apart."""
    pace = Pace()
    shown = []
    for number, step in enumerate(steps):
        pace.note(step, float(number))
        shown += [step] * (pace.seconds_left is not None)
    assert number > 2
    return shown


def test_placing_shows_no_time_left(problem):
    steps = list(solve(problem, SolverLimits(effort=0.3)))
    assert any(step.what.startswith("bounding what any placement can cover; covered so far: ") for step in steps)
    assert times_left(steps) == []


def test_the_first_steps_show_a_placement_and_its_gap_and_these_only_improve(problem):
    shown = [re.search(r"covered so far: ([0-9,]+), gap ([0-9.]+)%", step.what) for step in solve(problem)]
    figures = [(int(found[1].replace(",", "")), float(found[2])) for found in shown[:-1] if found]
    assert shown[0] is not None
    assert figures == sorted(figures, key=lambda figure: (figure[0], -figure[1]))
    assert figures[-1][0] == finish(solve(problem)).covered
