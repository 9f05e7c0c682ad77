"""Reduced problems: what they leave out, and the unit of their weights."""

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.concave import LOG_RETURNS
from seip_addon.core.choosing.placement.instance import common_unit, make_instance
from seip_addon.core.choosing.placement.problem import PlacementProblem
from seip_addon.core.choosing.placement.solver import solve
from tests.builders.placement_problems import HALVES, row_problem


@pytest.mark.parametrize(
    ("weights", "unit"),
    [
        ([3.0, 9.0], (3.0, True)),
        ([0.5, 0.75], (0.25, True)),
        ([2.0**40, 2.0**40 + 1], (1.0, True)),
        ([1.0, 2.0**40 + 1], (1.0, True)),
        ([1.0, np.pi], (1.0, False)),
        ([1.0, 2.0**60], (1.0, False)),
    ],
)
def test_unit_of_which_all_weights_are_multiples(weights, unit):
    assert common_unit(np.array(weights)) == unit


def test_dominated_candidates_and_targets_without_weight_are_left_out():
    seen = [[1, 1, 0, 0, 1], [1, 0, 0, 0, 1], [0, 0, 1, 0, 0], [0, 0, 0, 0, 1]]
    problem = row_problem(seen, positions=np.array([0, 0, 1, 2]), weights=np.array([1.0, 1.0, 2.0, 5.0, 0.0]), count=2)
    instance = make_instance(problem)
    assert instance.original.tolist() == [0, 2]
    assert instance.blocks[0].amounts.tolist() == [[0.0, 1.0], [1.0, 0.0]]
    assert instance.blocks[0].weight.tolist() == [2.0, 2.0]  # equal targets are one


@pytest.mark.parametrize(
    "changes",
    [
        {"mandatory": np.array([[0, 1, 0]], bool)},
        {"prices": np.array([2.0, 1.0, 2.0]), "budget": 3.0},
        {"xyz": np.array([[4.0, 0, 5], [0, 0, 5], [9, 0, 5]]), "min_distance": 6.0},
    ],
    ids=["serves a group", "cheaper", "farther away"],
)
def test_a_candidate_that_has_an_advantage_is_kept(changes):
    problem = row_problem(
        [[1, 1, 0], [1, 0, 0], [0, 0, 1]], **({"positions": np.array([0, 0, 1]), "count": 2} | changes)
    )
    assert 1 in make_instance(problem).original


@pytest.mark.parametrize(("g", "reason"), [(None, "sees any target"), (LOG_RETURNS, "has returns")])
def test_candidates_that_add_nothing_are_refused(g, reason):
    value = {} if g is None else {"g": g}
    with pytest.raises(SeipError, match=f"no candidate {reason}"):
        finish(solve(row_problem(np.zeros((4, 4)), **value)))


@pytest.mark.parametrize("offset", [0.0, 5e6])
def test_posts_as_far_apart_as_the_minimum_distance_may_both_carry_a_sensor(offset):
    xyz = np.array([(offset + x, offset, 4.0) for x in (0.0, 0.3, 0.6)])
    assert len(finish(solve(row_problem(np.eye(3), xyz=xyz, count=3, min_distance=0.3))).chosen) == 3


def crowded(seed: int, **changes) -> PlacementProblem:
    """Five sensors together see all; twelve see more each, of which one at most can be chosen, and not beside these.

    All weights together just fit into single precision; what each sensor sees, added up, does not.
    """
    random = np.random.default_rng(seed)
    weights = np.append(np.floor(random.uniform(0.9, 1.0, 4) * 2**22), 1.0)
    weights[0] += 2**24 - 1 - weights.sum()
    missed = random.integers(0, 5, 12)
    x = 10.0 * np.append(np.arange(5), missed) + np.append(np.zeros(5), random.uniform(-4, 4, 12))
    parts = {
        "weights": weights,
        "prices": random.choice([0.7, 1.0], 17),
        "positions": np.append(np.arange(5), np.full(12, 5)),
        "xyz": np.column_stack([x, np.zeros(17), np.full(17, 5.0)]),
        "count": 6,
        "min_distance": 5.0,
    }
    seen = np.concatenate([np.eye(5, dtype=bool), missed[:, None] != np.arange(5)])
    return row_problem(seen, **(parts | changes))


def test_sums_beyond_single_precision_cut_nothing():
    for seed in range(10):
        placement = finish(solve(crowded(seed)))
        assert (placement.objective, placement.chosen.tolist()) == (2.0**24 - 1, [0, 1, 2, 3, 4])


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_whole_weights_are_compared_exactly(order):
    """Of two sensors that see almost all of 2^41 the one that sees one unit more is chosen."""
    weights = np.array([2.0**40, 1.0, 2.0, 2.0**40])
    seen = np.array([[1, 1, 0, 1], [1, 0, 1, 1]])[list(order)]
    placement = finish(solve(row_problem(seen, weights=weights, count=1)))
    assert (placement.objective, placement.bound, placement.status) == (2.0**41 + 2, 2.0**41 + 2, "optimal")
    assert placement.chosen.tolist() == [order.index(1)]


@pytest.mark.parametrize("more", [1e-8, 1e-11])
def test_other_weights_are_compared_to_a_billionth(more):
    weights = np.array([np.pi, np.e, np.e * (1 + more) + np.pi * more])
    seen = [[1, 1, 0], [1, 0, 1]]
    placement = finish(solve(row_problem(seen, weights=weights, count=1)))
    best = weights[0] + weights[2]
    assert placement.status == "optimal"
    assert placement.objective == pytest.approx(best, abs=1e-9 * weights.sum())
    assert placement.chosen.tolist() == [1] or more < 1e-9


def test_halves_of_weights_are_whole_numbers_of_halves():
    placement = finish(solve(row_problem(HALVES, weights=np.array([0.5, 1.0, 1.5, 0.5]), count=1)))
    assert (placement.objective, make_instance(row_problem(HALVES)).step) == (2.5, 1.0)
