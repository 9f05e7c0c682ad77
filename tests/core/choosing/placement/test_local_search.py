"""Local search by swaps: its sums, and placements under budgets against enumeration and a plain tabu search."""

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from seip_addon.core.choosing.placement.feasibility import starting_choice
from seip_addon.core.choosing.placement.greedy import greedy_with_swaps
from seip_addon.core.choosing.placement.local_search import composition_search
from seip_addon.core.choosing.placement.problem import PlacementProblem
from seip_addon.core.choosing.placement.reduced_problem import make_instance
from seip_addon.core.choosing.placement.search_limits import Clock
from seip_addon.core.progress import finish

NONE = np.zeros(0, np.int64)  # no candidate chosen


def searched(problem: PlacementProblem) -> float:
    """Return the weight that the local search covers."""
    instance, _ = make_instance(problem)
    start = finish(starting_choice(problem, instance, "auto"))
    first = finish(greedy_with_swaps(instance, start))
    chosen = finish(composition_search(instance, start, first, Clock(math.inf, math.inf)))
    assert instance.feasible(chosen)
    return problem.covered(instance.original[chosen])


def budget_of_few(seed: int) -> PlacementProblem:
    """Return a budget problem of up to twelve candidates of two or three prices."""
    random = np.random.default_rng((32, seed))
    number, targets = int(random.integers(6, 13)), int(random.integers(10, 40))
    prices = random.choice([[6.0, 15.0], [2.0, 3.0, 7.0], [1.0, 1.1, 4.0]][seed % 3], number)
    positions = random.integers(0, number * 3 // 4, number)
    return PlacementProblem(
        visible=random.random((number, targets)) < random.choice([0.15, 0.3]),
        weights=random.integers(1, 6, targets).astype(float),
        prices=prices,
        positions=positions,
        xyz=np.column_stack([positions, positions, np.arange(number)]).astype(float),
        labels=np.array([f"type{index}" for index in range(number)]),
        budget=float(random.uniform(0.25, 0.7) * prices.sum()),
        count=2 if seed % 4 == 0 else None,
    )


def most_covered(problem: PlacementProblem) -> float:
    """Return the largest weight that any affordable choice covers, by enumeration."""
    number, best = len(problem.visible), 0.0
    for size in range(1, (problem.count or number) + 1):
        for choice in map(list, combinations(range(number), size)):
            affordable = math.fsum(problem.prices[choice]) <= problem.budget * (1 + 1e-9)
            served = problem.mandatory_groups[:, choice].any(axis=1).all()
            if affordable and served and len(np.unique(problem.positions[choice])) == size:
                best = max(best, float(problem.weights[problem.visible[choice].any(axis=0)].sum()))
    return best


@pytest.mark.parametrize(
    "seeds",
    [
        pytest.param(range(8), id="few"),
        pytest.param(range(8, 200), marks=pytest.mark.long, id="most"),
    ],
)
def test_local_search_finds_the_best_of_small_budget_problems(seeds: range) -> None:
    for seed in seeds:
        problem = budget_of_few(seed)
        assert (seed, searched(problem)) == (seed, most_covered(problem))


def test_local_search_keeps_the_required_positions() -> None:
    for seed in range(4):
        problem = budget_of_few(seed)
        required = problem.positions == problem.positions[problem.prices.argmin()]
        problem = replace(problem, mandatory=required[None])
        assert (seed, searched(problem)) == (seed, most_covered(problem))
