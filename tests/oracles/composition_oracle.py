"""Plain tabu search for each composition of sensor prices, which shares no code with the project's search."""

from __future__ import annotations

import itertools

from headless.studies.benchmark.street_visibility import street_problem

import numpy as np
from numpy.typing import NDArray

from seip_addon.core.choosing.placement.problem import PlacementProblem

PRICES = [[6.0, 15.0], [5.0, 8.0, 13.0], [6.0, 10.0, 25.0], [4.0, 7.0]]


def budget_problem(seed: int, positions: int, targets: int) -> PlacementProblem:
    """Return street visibility whose mounting heights are sensor types of different prices, under a budget."""
    random = np.random.default_rng((31, seed))
    prices = PRICES[seed % len(PRICES)]
    streets = street_problem(positions, targets, seed, heights=len(prices), blocks=2)
    budget = float(np.floor(random.uniform(4, 9) * prices[0]) + prices[-1])
    return PlacementProblem(
        visible=streets.visible,
        weights=streets.weights,
        prices=np.repeat(prices, positions),
        positions=streets.positions,
        xyz=streets.xyz,
        labels=np.repeat([f"type{number}" for number in range(len(prices))], positions),
        budget=budget,
    )


def best_of_compositions(problem: PlacementProblem, operations: float) -> float:
    """Return the largest weight that tabu searches of all compositions cover, within so many multiplications."""
    prices = np.unique(problem.prices)
    compositions = maximal_compositions(prices.tolist(), float(problem.budget or 0))
    return max(_searched(problem, prices, room, operations / len(compositions)) for room in compositions)


def maximal_compositions(prices: list[float], budget: float) -> list[tuple[int, ...]]:
    """Return the numbers of sensors of each price to which no sensor can be added."""
    ranges = [range(int(budget // price) + 1) for price in prices]
    cost = {room: sum(n * price for n, price in zip(room, prices, strict=True)) for room in itertools.product(*ranges)}
    return [room for room, spent in cost.items() if spent <= budget < spent + prices[0]]


def _searched(
    problem: PlacementProblem, prices: NDArray[np.float64], room: tuple[int, ...], operations: float
) -> float:
    see, weight = problem.visible.astype(float), problem.weights
    random = np.random.default_rng(7)
    chosen: list[int] = []
    for price, number in reversed(list(zip(prices, room, strict=True))):
        for _ in range(number):
            gain = see @ (weight * ~problem.visible[chosen].any(axis=0))
            gain[(problem.prices != price) | np.isin(problem.positions, problem.positions[chosen])] = -1
            if gain.max() < 0:
                return 0.0  # fewer positions than sensors
            chosen.append(int(gain.argmax()))
    best, until = _covered(problem, chosen), np.zeros(len(see))
    for step in range(int(operations / (see.size * len(chosen)))):
        value, move = -1.0, (0, 0)
        for slot, gone in enumerate(chosen):
            others = chosen[:slot] + chosen[slot + 1 :]
            uncovered = weight * ~problem.visible[others].any(axis=0)
            reached = weight.sum() - uncovered.sum() + see @ uncovered
            barred = (problem.prices != problem.prices[gone]) | np.isin(problem.positions, problem.positions[others])
            barred |= np.arange(len(see)) == gone
            barred |= ((until > step) | (until[gone] > step)) & (reached <= best)
            reached[barred] = -1
            if reached.max() > value:
                value, move = float(reached.max()), (slot, int(reached.argmax()))
        if value < 0:
            continue
        slot, came = move
        until[chosen[slot]], until[came] = step + random.integers(8, 17), step + random.integers(1, 4)
        chosen[slot] = came
        best = max(best, value)
    return best


def _covered(problem: PlacementProblem, chosen: list[int]) -> float:
    return float(problem.weights[problem.visible[chosen].any(axis=0)].sum())
