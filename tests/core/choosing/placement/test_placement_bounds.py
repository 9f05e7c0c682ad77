"""Bounds and searches that do not decide by themselves, against exhaustive search on the reduced problem."""

import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from seip_addon.core.choosing.placement import bounds
from seip_addon.core.choosing.placement.bounds import lagrangian_bound
from seip_addon.core.choosing.placement.local_search import composition_search
from seip_addon.core.choosing.placement.reduced_problem import make_instance
from seip_addon.core.choosing.placement.search_limits import Clock
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
from tests.oracles.placement_oracle import small_problems
from tests.oracles.random_cases import cases


def forever():
    return Clock(math.inf)


def reduced(problem):
    try:
        return make_instance(problem)[0]
    except SeipError:
        return None


def feasible(instance):
    sizes = range(1, min(instance.count, len(instance)) + 1)
    choices = [np.array(choice) for size in sizes for choice in combinations(range(len(instance)), size)]
    return [choice for choice in choices if instance.feasible(choice)]


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


@cases(100)
@given(small_problems())
def test_tabu_search_keeps_the_constraints_and_never_ends_worse(problem):
    instance = reduced(problem)
    assume(instance is not None)
    choices = feasible(instance)
    assume(choices)
    found = finish(composition_search(instance, choices[0], choices[0], forever()))
    assert instance.feasible(found)
    assert instance.value(found) >= instance.value(choices[0])
