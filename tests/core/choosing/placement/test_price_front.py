"""Placements with fewer and more sensors: their bounds agree with the certificate of the placement."""

from dataclasses import replace

import numpy as np
import pytest

from seip_addon.core.choosing.placement.objective import Objective, placement_problem
from seip_addon.core.choosing.placement.price_front import price_front
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.progress import finish
from tests.builders.report_folder import make_solution
from tests.builders.small_junction import make_example

AT_ONCE = 1e-6  # work after which searches end at once, so that only what is known can bound them


@pytest.fixture(scope="module")
def example():
    return make_example()


def problem_of(example, goal=None):
    return placement_problem(example.site, example.visible, example.models, goal or Objective(count=3))


def points_of(example, goal=None, effort=AT_ONCE, **found):
    """Return the front of a solution by its number of sensors."""
    goal = goal or Objective(count=3)
    solution = make_solution(example, goal, **found)
    return {point.count: point for point in finish(price_front(problem_of(example, goal), solution, effort))}


def test_more_sensors_never_see_less_and_the_own_number_is_that_of_the_solution(example):
    best = finish(solve(problem_of(example)))
    points = points_of(example, effort=0.2, chosen=best.chosen, objective=best.covered, bound=best.covered)
    assert list(points) == [1, 2, 3, 4, 5]
    assert all(np.diff([point.coverage for point in points.values()]) >= 0)
    assert points[3].coverage == pytest.approx(best.covered / len(example.site.targets))
    assert points[3].missed == 0


@pytest.mark.parametrize(("status", "room"), [("optimal", 0.0), ("feasible", 30.0)])
def test_the_front_has_the_bound_of_the_certificate_and_bounds_do_not_cross(example, status, room):
    best = finish(solve(problem_of(example)))
    points = points_of(example, status=status, objective=best.covered, bound=best.covered + room, chosen=best.chosen)
    whole = len(example.site.targets)
    assert (points[3].coverage, points[3].missed) == (best.covered / whole, room / whole)
    bounds = [point.coverage + point.missed for point in points.values()]
    assert (np.diff(bounds) >= -1e-12).all()  # up to rounding of the sum above


def test_a_budget_certifies_no_more_sensors_than_it_pays(example):
    problem = problem_of(example)
    two, three = (finish(solve(replace(problem, count=count))) for count in (2, 3))
    goal = Objective(count=3, budget=2 * float(problem.prices.max()))
    points = points_of(example, goal, effort=0.2, chosen=two.chosen, objective=two.covered, bound=two.covered)
    whole = len(example.site.targets)
    assert (points[2].coverage, points[2].missed) == (two.covered / whole, 0)
    assert points[3].coverage == pytest.approx(three.covered / whole)
    assert points[3].coverage > points[2].coverage


def test_placements_for_something_else_than_coverage_have_no_front(example):
    assert points_of(example, notes=("chosen for returns from road users: 240 returns from a car",)) == {}
