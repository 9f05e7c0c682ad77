"""Branch and bound against exhaustive search on the reduced problem."""

import math
from dataclasses import replace
from itertools import combinations

from headless.measures.streets import street_problem

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from placement_oracle import small_problems

from seip_addon.core.errors import SeipError
from seip_addon.core.placement.branch_and_bound import all_reaching, best_reaching
from seip_addon.core.placement.clock import Clock
from seip_addon.core.placement.instance import SLACK, make_instance
from seip_addon.core.progress import finish


def reduced(problem):
    try:
        return make_instance(problem)[0]
    except SeipError:
        return None


def feasible(instance):
    everyone = range(len(instance))
    sizes = range(min(instance.count, len(instance)) + 1)
    choices = (np.array(choice, dtype=np.int64) for size in sizes for choice in combinations(everyone, size))
    return [choice for choice in choices if instance.feasible(choice)]


def forever():
    return Clock(math.inf)


@settings(max_examples=300)
@given(small_problems(), st.floats(0.0, 1.0))
def test_the_best_placement_is_found_or_proven_absent(problem, share):
    instance = reduced(problem)
    assume(instance is not None)
    goal = share * instance.total
    best = max((instance.covered(choice) for choice in feasible(instance) if len(choice)), default=-1.0)
    found = finish(best_reaching(instance, goal, forever(), math.inf))
    assert found.finished
    if best >= goal + SLACK:
        (chosen,) = found.placements
        assert instance.feasible(chosen)
        assert instance.covered(chosen) == pytest.approx(best, abs=SLACK)
    elif best < goal - SLACK:
        assert found.placements == ()


@settings(max_examples=300)
@given(small_problems())
def test_every_smallest_placement_that_reaches_the_goal_is_listed(problem):
    instance = reduced(problem)
    assume(instance is not None)
    choices = [choice for choice in feasible(instance) if len(choice)]
    assume(choices)
    goal = max(map(instance.covered, choices))
    reaching = [choice for choice in choices if instance.covered(choice) >= goal - SLACK]
    fewest = min(map(len, reaching))
    found = finish(all_reaching(replace(instance, count=fewest), goal, 10_000, forever(), math.inf))
    assert found.finished
    listed = sorted(tuple(choice) for choice in found.placements)
    assert listed == sorted(tuple(choice) for choice in reaching if len(choice) == fewest)


def test_a_search_stops_at_its_limits():
    instance = make_instance(street_problem(60, 400, seed=3, count=5))[0]
    assert not finish(best_reaching(instance, 0.0, forever(), 0.0)).finished
    few = finish(all_reaching(instance, 0.2 * instance.total, 3, forever(), math.inf))
    assert not few.finished
    assert len(few.placements) > 3


def test_an_uneven_street_is_solved_as_well_as_an_even_one():
    problem = street_problem(25, 300, seed=5, count=3)
    weights = np.random.default_rng(1).uniform(0.5, 2.0, 300)
    instance = make_instance(replace(problem, weights=weights))[0]
    best = max(instance.covered(choice) for choice in feasible(instance))
    (chosen,) = finish(best_reaching(instance, 0.0, forever(), math.inf)).placements
    assert instance.covered(chosen) == pytest.approx(best)
