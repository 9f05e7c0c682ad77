"""Placements of random problems are what an enumeration of all subsets says, in whole numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from seip_addon.core.choosing.placement.cheapest import cheapest_for_coverage
from seip_addon.core.choosing.placement.problem import PlacementProblem
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.progress import finish
from tests.oracles.placement_search import DUST, UNDECIDED, WEIGHTS, faults, search


@pytest.mark.parametrize("seed", [249, 1_000_194, 100_277])
def test_problems_that_were_answered_wrongly(seed: int) -> None:
    assert faults(seed)[1] == []


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    ("first", "number"),
    [
        pytest.param(520, 20, id="quick"),
        pytest.param(100_000, 100, marks=pytest.mark.slow, id="many"),
        pytest.param(100_100, 2900, marks=pytest.mark.long, id="most"),
    ],
)
def test_placements_of_random_problems(first: int, number: int) -> None:
    total = search(number, first)
    assert [what for what in total if what.startswith("FAULT")] == []
    assert sum(total[name] for name in UNDECIDED) <= 0.01 * total["problems"], total
    assert sum(total[kind] for kind in (*WEIGHTS, DUST)) > 0.8 * number


def crowded(seed: int) -> PlacementProblem:
    """Five sensors together see all; twelve see more each, of which one at most can be chosen, and not beside these.

    All weights together just fit into single precision; what each sensor sees, added up, does not.
    """
    random = np.random.default_rng(seed)
    weights = np.append(np.floor(random.uniform(0.9, 1.0, 4) * 2**22), 1.0)
    weights[0] += 2**24 - 1 - weights.sum()
    missed = random.integers(0, 5, 12)
    x = 10.0 * np.append(np.arange(5), missed) + np.append(np.zeros(5), random.uniform(-4, 4, 12))
    return PlacementProblem(
        visible=np.concatenate([np.eye(5, dtype=bool), missed[:, None] != np.arange(5)]),
        weights=weights,
        prices=random.choice([0.7, 1.0], 17),
        positions=np.append(np.arange(5), np.full(12, 5)),
        xyz=np.column_stack([x, np.zeros(17), np.full(17, 5.0)]),
        labels=np.full(17, "type1"),
        count=6,
        min_distance=5.0,
    )


def test_sums_beyond_single_precision_cut_nothing() -> None:
    for seed in range(25):
        placement = finish(solve(crowded(seed)))
        assert (placement.objective, placement.chosen.tolist()) == (2.0**24 - 1, [0, 1, 2, 3, 4])


@pytest.mark.parametrize("price", [0.0, 7.0])
def test_where_all_prices_are_equal_the_fewest_sensors_are_the_cheapest(price: float) -> None:
    # two of three suffice, the third sees what one of them leaves
    problem = replace(crowded(0), weights=np.ones(5), prices=np.full(17, price), min_distance=0.0)
    placement = finish(cheapest_for_coverage(problem, 1.0))
    assert (len(placement.chosen), placement.status, placement.objective) == (2, "optimal", 2 * price)
