"""Random placement problems of 12 to 20 candidates, ordinary and hostile ones, with all constraints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.oracles.placement_case import PlacementCase

KINDS = (
    "ordinary",
    "ties",
    "copies of candidates",
    "targets without weight",
    "weights over 12 orders of magnitude",
    "weights near 2^40",
    "one target",
    "blind candidates",
    "infeasible",
)
PRICES = ([1.0], [0.0], [6_000.0, 15_000.0], [6_000.0, 15_000.0, 80_000.0], [0.7, 1.0, 1.1], [0.0, 3_125.0, 10_750.0])


def draw_case(seed: int, most: int = 20, *, coverage_only: bool = False) -> tuple[str, PlacementCase]:
    """Return the kind of a problem, and the problem, of at most ``most`` candidates; kinds and criteria take turns."""
    rng = np.random.default_rng((44, seed))
    kind, logarithm = KINDS[seed % len(KINDS)], bool(seed // len(KINDS) % 2) and not coverage_only
    number = int(rng.choice([12, 13, 14, 15, 16, 17, 18, 20], p=[0.2, 0.2, 0.2, 0.15, 0.1, 0.05, 0.05, 0.05]))
    number = min(number, most)
    targets = 1 if kind == "one target" else int(rng.integers(5, 60))
    amounts = _amounts(rng, kind, (number, targets), logarithm=logarithm)
    prices = rng.choice(PRICES[rng.integers(len(PRICES))], number)
    limited = rng.random(6) < [0.3, 0.3, 0.4, 0.5, 0.3, 0.75]
    positions = np.sort(rng.integers(0, int(rng.integers(5, number)), number)) if limited[2] else np.arange(number)
    xy = rng.uniform(0, 30, (number, 2)) if rng.random() < 0.5 else 5.0 * rng.integers(0, 6, (number, 2))
    forbidden = rng.random(number) < 0.2 if limited[0] else np.zeros(number, bool)
    forbidden[0] = False
    case = PlacementCase(
        amounts=amounts,
        logarithm=logarithm,
        weights=_weights(rng, kind, targets),
        prices=prices,
        positions=positions,
        xyz=np.column_stack([xy[positions], rng.choice([3.5, 5.4, 8.0], number)]),
        labels=rng.choice(["type1", "type2", "type3"], number),
        mandatory=_groups(rng, ~forbidden, int(rng.integers(1, 4)) if limited[1] else 0),
        forbidden=forbidden,
        budget=float(prices.sum() * rng.choice([0.15, 0.25, 0.35, 0.5])) if limited[3] else np.inf,
        min_distance=float(rng.choice([5.0, 8.0, 12.0])) if limited[4] else 0.0,
    )
    places = len(np.unique(positions[~forbidden]))
    case = replace(case, count=min(places, int(rng.choice([1, 2, 3, 4, 5, 6, 7]))) if limited[5] else None)
    return kind, _infeasible(rng, case) if kind == "infeasible" else case


def _amounts(rng, kind, shape, *, logarithm):
    seen = rng.random(shape) < rng.choice([0.1, 0.2, 0.3, 0.4, 0.6])
    if kind == "blind candidates":
        seen[rng.random(shape[0]) < 0.6] = False
    seen[0, 0] = True  # of candidates that are allowed, one sees a target
    amounts = seen
    if logarithm:
        returns = rng.choice([1.0, 7.0], shape) if kind == "ties" else 10 ** rng.uniform(*_decades(rng), shape)
        amounts = (seen * returns).astype(np.float32)
    if kind == "copies of candidates":
        half = shape[0] // 2
        amounts[-half:] = amounts[:half]
    return amounts


def _decades(rng):
    return [(-6, 5), (-2, 0), (0, 3), (4.9, 5.0)][rng.integers(4)]


def _weights(rng, kind, number):
    weights = {
        "ties": lambda: np.ones(number),
        "targets without weight": lambda: rng.choice([0.0, 0.0, 1.0, 2.5], number),
        "weights over 12 orders of magnitude": lambda: 10 ** rng.uniform(-6, 6, number),
        "weights near 2^40": lambda: 2.0**40 + rng.integers(0, 3, number),
    }.get(kind, lambda: rng.choice([1.0, 2.0, 5.0], number) if rng.random() < 0.5 else rng.uniform(0.1, 2.0, number))()
    weights[0] = max(weights[0], 1.0)
    return weights


def _groups(rng, allowed, number):
    groups = (rng.random((number, len(allowed))) < 0.3) & allowed
    groups[~groups.any(axis=1), 0] = True
    return groups


def _infeasible(rng, case):
    """Require two groups that cannot be served together: by the number, the price, a position or the spacing."""
    number = len(case.prices)
    groups = np.zeros((2, number), bool)
    groups[0, :2], groups[1, 2:4] = True, True
    case = replace(case, mandatory=groups, forbidden=np.zeros(number, bool))
    how = rng.integers(4)
    if how == 0:
        return replace(case, count=1)
    if how == 1:
        prices = np.where(groups.any(axis=0), 10.0, 1.0)
        return replace(case, prices=prices, budget=19.9, count=None)
    if how == 2:  # one position for all four
        positions = np.where(np.arange(number) < 4, 0, np.arange(number))
        return replace(case, positions=positions, xyz=case.xyz[positions], count=None)
    return replace(case, xyz=case.xyz * [0.0, 0.0, 1.0], min_distance=1.0, positions=np.arange(number), count=None)
