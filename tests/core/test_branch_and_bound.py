"""Branch and bound against exhaustive search on the reduced problem."""

import math
from dataclasses import replace
from itertools import combinations

from headless.street_visibility import street_problem

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from placement_oracle import small_problems

from seip_addon.core.errors import SeipError
from seip_addon.core.placement import branch_and_bound
from seip_addon.core.placement.branch_and_bound import best_placements, first_in_order, merit
from seip_addon.core.placement.clock import Clock
from seip_addon.core.placement.instance import make_instance
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


def search(instance, goal, most=10_000, seconds=math.inf):
    return finish(best_placements(instance, goal, most, instance.total, forever(), seconds))


@pytest.fixture(scope="module", params=[1, 10**9], ids=["relaxed", "not relaxed"], autouse=True)
def _relax(request):
    """Small problems have few children; relax their nodes none the less, and not at all."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(branch_and_bound, "WIDE", request.param)
        patch.setattr(branch_and_bound, "RELAXED", 2)
        yield


@settings(max_examples=200, deadline=None)
@given(small_problems(), st.floats(0.0, 1.0))
def test_all_best_placements_are_listed_or_proven_absent(problem, share):
    instance = reduced(problem)
    assume(instance is not None)
    goal = share * instance.total
    choices = [choice for choice in feasible(instance) if len(choice)]
    best = max(map(instance.covered, choices), default=-1.0)
    found = search(instance, goal)
    assert found.finished
    assert found.complete
    if best < goal - instance.slack:
        assert found.placements == ()
        return
    equal = [choice for choice in choices if instance.covered(choice) == best]
    listed = {tuple(choice) for choice in found.placements}
    assert listed <= {tuple(choice) for choice in equal}
    fewest = min(map(len, equal))
    assert listed >= {tuple(choice) for choice in equal if len(choice) == fewest}
    few = search(instance, goal, most=1)
    assert few.finished
    assert len(few.placements) == 1
    np.testing.assert_array_equal(few.placements[0], found.placements[0])
    assert few.complete == (len(found.placements) == 1)


@settings(max_examples=300, deadline=None)
@given(small_problems())
def test_the_first_in_order_is_found(problem):
    instance = reduced(problem)
    assume(instance is not None)
    choices = [choice for choice in feasible(instance) if len(choice)]
    assume(choices)
    goal = max(map(instance.covered, choices))
    equal = [choice for choice in choices if instance.covered(choice) >= goal - instance.slack]
    first = min(equal, key=lambda choice: merit(instance, choice))
    found, finished = finish(first_in_order(replace(instance, count=len(first)), goal, forever(), math.inf))
    assert finished
    np.testing.assert_array_equal(found, first)


def test_a_search_stops_at_its_limit():
    instance = make_instance(street_problem(60, 400, seed=3, count=5))[0]
    assert not search(instance, 0.0, seconds=0.0).finished


def test_an_uneven_street_is_solved_as_well_as_an_even_one():
    problem = street_problem(25, 300, seed=5, count=3)
    weights = np.random.default_rng(1).uniform(0.5, 2.0, 300)
    instance = make_instance(replace(problem, weights=weights))[0]
    best = max(instance.covered(choice) for choice in feasible(instance))
    (chosen,) = search(instance, 0.0).placements
    assert instance.covered(chosen) == best
