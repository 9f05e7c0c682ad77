"""Placements of fewer and of more sensors: each is the best of its number, and none contradicts another."""

from dataclasses import replace

import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.concave import LOG_RETURNS
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.placement.solver import MORE, front_of, solve
from tests.builders.placement_problems import HALVES, hard_problem, random_problem, row_problem

AT_ONCE = 1e-6  # work after which searches end at once

values = pytest.mark.parametrize("g", [{}, {"g": LOG_RETURNS}], ids=["coverage", "returns"])


@pytest.mark.parametrize("returns", [False, True], ids=["coverage", "returns"])
def test_each_number_has_the_best_placement_and_more_sensors_are_never_worse(returns):
    for seed in range(4):
        problem = random_problem(seed, returns=returns, count=3, mandatory=None, min_distance=0.0)
        placement = finish(solve(problem))
        front = finish(front_of(problem, placement, range(0), effort=8.0))
        assert list(front) == list(range(1, min(len(placement.chosen) + MORE, len(set(problem.positions))) + 1))
        for count, one in front.items():
            best = finish(solve(replace(problem, count=count, budget=None)))
            assert one.objective == pytest.approx(best.objective, rel=1e-8)
            assert one.gap == pytest.approx(0.0, abs=1e-7)
        assert (np.diff([one.objective for one in front.values()]) >= 0).all()


@values
def test_unproven_values_and_bounds_do_not_cross(g):
    problem = hard_problem(60, 300, count=4, **g)
    placement = finish(solve(problem, SolverLimits(effort=0.05)))
    front = finish(front_of(problem, placement, range(4, 5), effort=AT_ONCE))
    assert list(front) == [1, 2, 3, 4, 5, 6]
    objectives, bounds = ([getattr(one, name) for one in front.values()] for name in ("objective", "bound"))
    assert objectives == sorted(objectives)
    assert bounds == sorted(bounds)
    assert all(bound >= value for bound, value in zip(bounds, objectives, strict=True))
    assert [len(one.chosen) for one in front.values()] == [1, 2, 3, 4, 5, 6]


def test_own_number_is_the_placement_with_its_certificate():
    problem = row_problem(HALVES, count=2)
    placement = replace(finish(solve(problem)), status="feasible", bound=5.0)
    front = finish(front_of(problem, placement, range(2, 3), effort=AT_ONCE))
    assert (front[2].objective, front[2].bound, front[2].gap) == (4.0, 4.0, 0.0)  # three and four see no more
    tight = finish(front_of(problem, placement, range(2, 5), effort=AT_ONCE))
    assert (tight[2].chosen is placement.chosen, tight[2].bound, tight[2].gap) == (True, 5.0, 0.25)


def test_a_budget_limits_no_other_number_and_groups_need_theirs():
    problem = row_problem(HALVES, count=2, budget=6000.0, mandatory=np.array([[0, 0, 0, 1]], bool))
    placement = finish(solve(problem))
    front = finish(front_of(problem, placement, range(0)))
    assert [one.chosen.tolist() for one in front.values()] == [[3], [0, 3], [0, 1, 3]]
    both = replace(problem, budget=None, mandatory=np.eye(4, dtype=bool)[2:])
    assert list(finish(front_of(both, finish(solve(both)), range(0)))) == [2, 3, 4]
