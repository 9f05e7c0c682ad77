"""Sums of concave values: their gains, and linear bounds on them for random sets of sensors."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.choosing.placement.concave import COVERAGE, LOG_RETURNS, Steps
from tests.oracles.random_cases import cases

VALUES = [Steps((1.0,)), Steps((3.0, 1.0)), Steps((2.0, 1.5, 0.25)), LOG_RETURNS]
each_value = pytest.mark.parametrize("g", VALUES, ids=lambda g: f"{len(g.rises)} rises" if g != LOG_RETURNS else "ln")
seeds = given(st.integers(0, 10**9))


def random_sum(g, random, *, single=False):
    """Return a sum over 3 to 20 candidates and 1 to 12 targets; amounts of returns are of all sizes."""
    shape = random.integers(3, 20), random.integers(1, 12)
    amounts = random.random(shape) < random.uniform(0.1, 0.9)
    if g == LOG_RETURNS:
        amounts = amounts * 10.0 ** random.uniform(-3, random.uniform(-2, 5), shape)
    return g.sum_over(amounts, random.uniform(0.1, 2.0, shape[1]), single=single)


def random_set(block, random):
    return np.flatnonzero(random.random(len(block)) < random.uniform(0.0, 1.0))


def random_parameters(block, base, random):
    """Return parameters of a bound: between the limits, at them, or beyond and moved into them."""
    lowest = block.lowest(base)
    most = np.where(lowest < 0, 0.0, lowest + 5.0)
    parameters = random.uniform(lowest - 1.0, most + 1.0)
    at_step = random.random(len(base)) < 0.3
    parameters[at_step] = -np.array([*getattr(block.g, "rises", [0.0]), 0.0])[random.integers(2)]
    return block.clipped(base, parameters)


@each_value
@cases(400)
@seeds
def test_linear_bound_holds_for_all_sets_at_any_base_and_parameters(g, seed):
    random = np.random.default_rng(seed)
    block = random_sum(g, random)
    base = block.together(random_set(block, random))
    constant, scores = block.bound(base, random_parameters(block, base, random))
    for _ in range(100):
        further = random_set(block, random)
        value = block.value_at(base + block.amounts[further].sum(axis=0, dtype=np.float64))
        assert value <= constant + math.fsum(scores[further]) + block.rounding


@each_value
@cases(100)
@seeds
def test_linear_bound_at_its_smallest_parameters_is_exact_for_one_sensor(g, seed):
    random = np.random.default_rng(seed)
    block = random_sum(g, random)
    base = block.together(random_set(block, random))
    constant, scores = block.bound(base, block.lowest(base))
    assert constant == pytest.approx(block.value_at(base), abs=block.rounding)
    assert scores == pytest.approx(block.gains(base), abs=block.rounding)


@each_value
@cases(100)
@seeds
def test_slope_is_the_derivative_of_the_bound_with_a_set(g, seed):
    random = np.random.default_rng(seed)
    block = random_sum(g, random)
    base, picked = (block.together(random_set(block, random)), random_set(block, random))

    def bound(parameters):
        constant, scores = block.bound(base, parameters)
        return constant + math.fsum(scores[picked])

    parameters = random_parameters(block, base, random)
    slope = block.weight * block.slope(base, parameters, picked)
    lowest = block.lowest(base)
    for target in range(len(base)):
        moved = parameters.copy()
        if g == LOG_RETURNS:  # a small step, away from the limit and from where tangent and curve meet
            moved[target] += 0.02
            if parameters[target] == lowest[target]:
                continue
            change = (bound(moved) - bound(parameters)) / 0.02
            ends = slope[target], (block.weight * block.slope(base, moved, picked))[target]
            assert min(ends) - 0.01 <= change <= max(ends) + 0.01
        else:  # a convex function is nowhere below its tangents
            moved[target] = random.uniform(lowest[target], 0.0)
            change = slope[target] * (moved[target] - parameters[target])
            if slope[target] != 0.0:
                assert bound(moved) >= bound(parameters) + change - 1e-9


@pytest.mark.parametrize("single", [False, True], ids=["double", "single"])
@pytest.mark.parametrize("g", VALUES[:2], ids=["1 rise", "2 rises"])
def test_updated_gains_equal_the_full_product(g, single):
    random = np.random.default_rng(3)
    weight = random.integers(1, 50, 300).astype(float) if single else random.uniform(0.1, 2.0, 300)
    block = g.sum_over(random.random((80, 300)) < 0.1, weight, single=single)
    chosen = random.choice(80, 6, replace=False)
    for step in range(1000):
        # swaps, as a search makes them; and now and then another placement altogether
        chosen[step % 6] = random.integers(80)
        if step % 37 == 0:
            chosen = random.choice(80, 6, replace=False)
        base = block.together(chosen)
        each = block.weight * (g(base + 1.0) - g(base))
        expected = block.amounts.astype(np.float64) @ each
        assert block.gains(base) == pytest.approx(expected, abs=0.0 if single else 1e-11)


@each_value
@cases(50)
@seeds
def test_gains_are_those_of_the_values_also_after_another_candidate(g, seed):
    random = np.random.default_rng(seed)
    block = random_sum(g, random)
    chosen, first = random_set(block, random), random_set(block, random)
    base = block.together(chosen)

    def gains(base):
        return [block.value_at(base + amounts) - block.value_at(base) for amounts in block.amounts.astype(np.float64)]

    assert block.gains(base) == pytest.approx(np.array(gains(base)), abs=block.rounding)
    if len(first) and g != LOG_RETURNS:
        after = block.gains_after(base, first)
        expected = [gains(base + block.amounts[one].astype(np.float64)) for one in first]
        assert after == pytest.approx(np.array(expected), abs=block.rounding)


def test_gap_is_a_share_of_coverage_or_of_returns():
    assert COVERAGE.gap(100.0, 110.0, 500.0) == pytest.approx(0.1)
    assert COVERAGE.gap(0.0, 0.0, 500.0) == 0.0
    assert LOG_RETURNS.gap(math.log(45.0), math.log(45.9), 1.0) == pytest.approx(0.02)
    assert LOG_RETURNS.gap(2 * math.log(45.0), 2 * math.log(45.9), 2.0) == pytest.approx(0.02)
