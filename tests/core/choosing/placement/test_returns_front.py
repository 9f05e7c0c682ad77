"""Returns of fewer and more sensors than a placement has, against brute force."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seip_addon.core.choosing.placement.objective import Objective, Solution
from seip_addon.core.choosing.placement.price_front import MORE
from seip_addon.core.choosing.placement.returns_front import returns_front
from seip_addon.core.choosing.placement.returns_solver import solve_returns
from seip_addon.core.progress import finish
from tests.core.choosing.placement.test_returns_placement import best_by_brute_force, problem_of

AT_ONCE = 1e-6  # work after which searches end at once


def solved(problem, returns):
    """Return the solution of a problem; nothing of its deployment matters here."""
    goal = Objective(criterion="returns", count=problem.count, budget=problem.budget)
    return Solution(goal, finish(solve_returns(problem, returns)), None, None)


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 10**9))
def test_each_number_of_sensors_has_the_returns_of_the_best_of_all(seed):
    problem, returns = problem_of(seed)
    solution = solved(problem, returns)
    front = finish(returns_front(problem, returns, solution, effort=60.0))
    positions = len(np.unique(problem.positions))
    numbers = [point.count for point in front]
    if len(solution.placement.chosen) == 0:
        assert front == ()
        return
    assert numbers[-1] == min(len(solution.placement.chosen) + MORE, positions)
    assert numbers == list(range(numbers[0], numbers[-1] + 1))
    for point in front:
        best = best_by_brute_force(replace(problem, count=point.count, budget=None), returns)
        assert math.log1p(point.returns) == pytest.approx(best, abs=1e-7)
        assert point.gap == pytest.approx(0.0, abs=1e-6)


def test_the_own_number_is_that_of_the_placement_with_its_certificate():
    problem, returns = problem_of(5, count=2, budget=None)
    solution = solved(problem, returns)
    unproven = replace(solution.placement, status="feasible", bound=solution.placement.objective + 0.25)
    front = finish(returns_front(problem, returns, replace(solution, placement=unproven), effort=AT_ONCE))
    own = next(point for point in front if point.count == len(solution.placement.chosen))
    assert own.returns == pytest.approx(math.expm1(solution.placement.objective))
    assert own.price == solution.placement.price
    assert own.gap <= math.expm1(0.25) + 1e-12
