"""A search may end at any step: its reports must not look like counted work, from which a time left would follow."""

import math
import re
from dataclasses import replace

from headless.studies.benchmark.street_visibility import street_problem

import numpy as np
import pytest

from seip_addon.core.choosing.placement.greedy import greedy
from seip_addon.core.choosing.placement.local_search import composition_search
from seip_addon.core.choosing.placement.reduced_problem import make_instance
from seip_addon.core.choosing.placement.returns_solver import solve_returns
from seip_addon.core.choosing.placement.search_limits import Clock, SolverLimits
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.progress import Pace, finish


@pytest.fixture(scope="module")
def problem():
    return street_problem(30, 300, count=5)


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
    steps = list(solve(problem, SolverLimits(effort=0.5)))
    assert any(step.what.startswith("bounding what any placement can cover; covered so far: ") for step in steps)
    assert times_left(steps) == []


def test_tabu_search_shows_no_time_left(problem):
    instance = make_instance(problem)[0]
    chosen = greedy(instance, np.zeros(0, dtype=np.int64))
    assert times_left(composition_search(instance, chosen[:0], chosen, Clock(math.inf))) == []


def test_the_first_steps_show_a_placement_and_its_gap_and_these_only_improve(problem):
    shown = [re.search(r"covered so far: ([0-9,]+), gap ([0-9.]+)%", step.what) for step in solve(problem)]
    figures = [(int(found[1].replace(",", "")), float(found[2])) for found in shown[:-1] if found]
    assert shown[0] is not None
    assert figures == sorted(figures, key=lambda figure: (figure[0], -figure[1]))
    assert figures[-1][0] == finish(solve(problem)).covered


def test_the_first_steps_by_returns_show_a_placement_and_its_gap_and_these_only_improve():
    random = np.random.default_rng(5)
    returns = (random.lognormal(1, 1, (60, 80)) * (random.random((60, 80)) < 0.2)).astype(np.float32)
    problem = replace(street_problem(60, 80, heights=1), visible=returns > 0, weights=np.ones(80), count=5)
    steps = list(solve_returns(problem, returns))
    shown = [re.search(r"; returns so far: ([0-9,.]+), gap ([0-9.]+)%$", step.what) for step in steps]
    assert all(shown)
    figures = [(float(found[1].replace(",", "")), -float(found[2])) for found in shown]
    assert figures == sorted(figures)
    assert [gap for _, gap in figures] == sorted(gap for _, gap in figures)
    best = finish(solve_returns(problem, returns)).objective
    assert figures[-1][0] == pytest.approx(math.expm1(best), rel=0.06)  # shown with two digits
    assert math.expm1(best) <= (1 + 1.06 * figures[0][0]) * (1 - figures[0][1] / 100) - 1
    assert times_left(steps) == []
