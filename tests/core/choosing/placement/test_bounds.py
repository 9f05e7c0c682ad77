"""Upper bounds against all feasible choices of small problems."""

import itertools
import math
from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.choosing.placement.bounds import bound_at, compositions, falling_bounds, rest_of
from seip_addon.core.choosing.placement.instance import make_instance
from tests.builders.placement_problems import all_choices, random_problem, row_problem
from tests.oracles.random_cases import cases

seeds = given(st.integers(0, 10**9), st.booleans())


def small_instance(seed, returns, **changes):
    try:
        return make_instance(random_problem(seed, returns=returns, **changes))
    except SeipError:  # of random candidates some cannot all be seated
        return make_instance(random_problem(0, returns=returns))


def keeps_to(composition, choice):
    if composition is None:
        return True
    quota = np.array(composition.quota)
    return bool((np.bincount(composition.kind[choice], minlength=len(quota)) <= quota).all())


@cases(200)
@seeds
def test_no_choice_exceeds_any_of_the_falling_bounds_nor_those_of_its_candidates(seed, returns):
    instance = small_instance(seed, returns)
    (block,), choices = instance.blocks, all_choices(instance)
    value = {tuple(one): instance.value(one) for one in choices}
    for composition in [None, *compositions(instance)]:
        within = [one for one in choices if keeps_to(composition, one)]
        rest = rest_of(instance, np.zeros(0, dtype=np.int64), np.arange(len(instance)), composition)
        base = np.zeros(len(block.weight))
        begin = bound_at(block, rest, base, block.start(base), block.rounding)
        steps = falling_bounds(block, rest, base, begin, 0.0, block.rounding)
        values = []
        lowest = bound_at(block, rest, base, block.lowest(base), block.rounding)
        for bound in (lowest, begin, *itertools.islice(steps, 40)):
            forced = bound.forced()
            for one in within:
                assert value[tuple(one)] <= bound.value
                assert (value[tuple(one)] <= forced[one] + 1e-9).all()
            values.append(bound.value)
        assert values[1:] == sorted(values[1:], reverse=True)


@cases(200)
@seeds
def test_compositions_cover_every_affordable_choice(seed, returns):
    instance = small_instance(seed, returns)
    every = compositions(instance)
    if not every:
        return
    assert math.isfinite(instance.budget)
    for choice in all_choices(instance):
        assert any(keeps_to(one, choice) for one in every)
    for one, other in itertools.permutations([np.array(one.quota) for one in every], 2):
        assert (one > other).any()  # none is a part of another


def test_compositions_of_two_prices():
    instance = make_instance(row_problem(prices=np.array([6.0, 6.0, 15.0, 15.0]), budget=27.0))
    assert sorted(one.quota for one in compositions(instance)) == [(2, 1), (3, 0)]
    assert sorted(one.quota for one in compositions(replace(instance, budget=26.0))) == [(1, 1), (3, 0)]
    assert compositions(replace(instance, budget=math.inf)) == []
