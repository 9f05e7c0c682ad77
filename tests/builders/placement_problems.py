"""Placement problems without a site: poses on a line, random small ones, and a large one."""

from itertools import combinations

import numpy as np

from seip_addon.core.choosing.placement.concave import COVERAGE, LOG_RETURNS
from seip_addon.core.choosing.placement.instance import Instance
from seip_addon.core.choosing.placement.problem import PlacementProblem

HALVES = [[1, 1, 0, 0], [0, 0, 1, 1], [0, 1, 1, 0], [0, 0, 0, 1]]
"""Targets that each of four poses sees: the first two together see all of them."""


def row_problem(visible=HALVES, **changes) -> PlacementProblem:
    """Return a problem of poses 10 m apart on a line, one at each position, all of one type."""
    amounts = np.asarray(visible)
    number, targets = amounts.shape
    parts = {
        "weights": np.ones(targets),
        "prices": np.full(number, 6000.0),
        "positions": np.arange(number),
        "xyz": np.column_stack([10.0 * np.arange(number), np.zeros(number), np.full(number, 5.0)]),
        "labels": np.full(number, "type1"),
        "amounts": amounts if amounts.dtype.kind == "f" else amounts.astype(bool),
    }
    return PlacementProblem(**(parts | changes))


def random_problem(seed, *, returns=False, poses=9, targets=14, **changes) -> PlacementProblem:
    """Return a problem of several poses at most positions, with any of the constraints, that has a solution."""
    random = np.random.default_rng((71, seed))
    positions = np.sort(random.integers(0, max(3, poses * 2 // 3), poses))
    prices = random.choice([[6.0], [6.0, 15.0], [2.0, 3.0, 7.0]][random.integers(3)], poses)
    amounts = random.random((poses, targets)) < random.choice([0.15, 0.3, 0.5])
    amounts[0, 0] = True
    if returns:
        amounts = (amounts * random.lognormal(random.uniform(-2, 4), random.uniform(0.2, 2), amounts.shape)).astype(
            "f4"
        )
    cheapest = np.arange(poses) == prices.argmin()
    limits = {"count": int(min(random.integers(1, 6), len(np.unique(positions))))}
    if random.random() < 0.5:
        limits["budget"] = float(prices.min() + random.uniform(0.0, 0.5) * prices.sum())
    if random.random() < 0.4:
        limits["min_distance"] = float(random.uniform(1, 12))
    if random.random() < 0.4:
        limits["mandatory"] = cheapest | (random.random((1, poses)) < 0.2)
    weights = random.uniform(0.1, 2.0, targets) if random.random() < 0.5 else random.integers(1, 6, targets) * 0.5
    xy = random.uniform(0, 30, (poses, 2))[positions]
    return PlacementProblem(
        **{
            "g": LOG_RETURNS if returns else COVERAGE,
            "amounts": amounts,
            "weights": weights,
            "prices": prices,
            "positions": positions,
            "xyz": np.column_stack([xy, np.arange(poses) % 3]),
            "labels": np.array([f"type{number:02}" for number in random.permutation(poses)]),
        }
        | limits
        | changes
    )


def hard_problem(poses=150, targets=900, **changes) -> PlacementProblem:
    """Return a problem whose proof takes long: sensors that overlap a little everywhere."""
    seen = np.random.default_rng(7).random((poses, targets)) < 0.12
    return row_problem(seen, **({"count": 8} | changes))


def all_choices(instance: Instance) -> list[np.ndarray]:
    """Return all feasible choices of an instance."""
    sizes = range(min(instance.count, len(instance)) + 1)
    choices = (np.array(one, dtype=np.int64) for size in sizes for one in combinations(range(len(instance)), size))
    return [one for one in choices if instance.feasible(one)]
