"""Branch and bound, and the bound that it cuts by, against exhaustive search on the reduced problem."""

import math
from itertools import combinations

from headless.studies.benchmark.street_visibility import street_problem

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from seip_addon.core.choosing.placement import bounds, branch_and_bound
from seip_addon.core.choosing.placement.bounds import lagrangian_bound
from seip_addon.core.choosing.placement.branch_and_bound import BestPlacements
from seip_addon.core.choosing.placement.reduced_problem import make_instance
from seip_addon.core.choosing.placement.search_limits import Clock
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
from tests.oracles.placement_oracle import small_problems
from tests.oracles.random_cases import cases


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


def searched(instance, goal, most=10_000):
    search = BestPlacements(instance, goal, most, instance.total)
    assert finish(search.run(forever(), math.inf))
    return search


@pytest.fixture(scope="module", params=[1, 10**9], ids=["relaxed", "not relaxed"], autouse=True)
def _relax(request):
    """Small problems have few children; relax their nodes none the less, and not at all."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(branch_and_bound, "MIN_CHILDREN", request.param)
        patch.setattr(branch_and_bound, "MIN_SENSORS", 2)
        yield


@cases(200)
@given(small_problems(), st.floats(0.0, 1.0))
def test_all_best_placements_are_listed_or_proven_absent(problem, share):
    instance = reduced(problem)
    assume(instance is not None)
    goal = share * instance.total
    choices = [choice for choice in feasible(instance) if len(choice)]
    best = max(map(instance.value, choices), default=-1.0)
    search = searched(instance, goal)
    assert not search.overflowed
    if best < goal - instance.slack:
        assert search.found == []
        return
    equal = [choice for choice in choices if instance.value(choice) == best]
    listed = {tuple(choice) for choice in search.found}
    assert listed <= {tuple(choice) for choice in equal}
    fewest = min(map(len, equal))
    assert listed >= {tuple(choice) for choice in equal if len(choice) == fewest}
    few = searched(instance, goal, most=1)
    assert len(few.found) == 1
    np.testing.assert_array_equal(few.found[0], search.found[0])
    assert few.overflowed == (len(search.found) > 1)


@cases(100)
@given(small_problems())
def test_the_bound_of_a_search_that_was_stopped_holds_and_the_search_can_go_on(problem):
    instance = reduced(problem)
    assume(instance is not None)
    best = max(map(instance.value, (choice for choice in feasible(instance) if len(choice))), default=-1.0)
    assume(best > 0)
    search = BestPlacements(instance, 0.0, 10_000, instance.total)
    bounds, clock = [], Clock(math.inf, 1e9)
    while not finish(search.run(clock, 0.0)):
        found = max(map(instance.value, search.found), default=0.0)
        assert max(found, search.bound) >= best
        bounds.append(search.bound)
    assert bounds == sorted(bounds, reverse=True)
    assert instance.value(search.found[0]) == best


def test_a_full_queue_changes_nothing(monkeypatch):
    instance = make_instance(street_problem(30, 200, seed=4, count=4))[0]
    plain = searched(instance, 0.0)
    monkeypatch.setattr(branch_and_bound, "MAX_WAITING_FOLLOWERS", 100)
    deep = searched(instance, 0.0)
    assert {tuple(choice) for choice in deep.found} == {tuple(choice) for choice in plain.found}


@cases(150)
@given(small_problems(), st.floats(0.0, 1.0))
def test_every_placement_that_reaches_the_goal_is_left(problem, share):
    instance = reduced(problem)
    assume(instance is not None)
    reaching = [choice for choice in feasible(instance) if instance.value(choice) >= share * instance.total]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bounds, "REDUCTION_INTERVAL", 2)
        patch.setattr(bounds, "MAX_KEPT_SHARE", 1.0)
        patch.setattr(bounds, "MAX_LISTED_CHOICES", 1)
        keep, bound = finish(lagrangian_bound(instance, share * instance.total, forever()))
    assert all(np.isin(choice, keep).all() for choice in reaching)
    assert all(instance.value(choice) <= bound.value + instance.slack for choice in reaching)
