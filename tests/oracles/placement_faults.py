"""What is wrong with a solver's answers to random placement problems, by enumeration of all subsets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.cheapest import cheapest_for_share
from seip_addon.core.choosing.placement.concave import COVERAGE, LOG_RETURNS
from seip_addon.core.choosing.placement.problem import Placement, PlacementProblem
from seip_addon.core.choosing.placement.risk import Risk
from seip_addon.core.choosing.placement.search_limits import DEFAULT_LIMITS, SolverLimits
from seip_addon.core.choosing.placement.solver import solve

Boolean = NDArray[np.bool_]
Float = NDArray[np.float64]

LEAST_EXCESS = 1 + 1e-9
"""Prices are decimals, whose sums floats round: this much above a budget is within it."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PlacementCase:
    """Maximise sum_t w_t g(sum_{i in S} A_it), where g(x) is min(x, 1) or, for returns, log(1 + x).

    Parameters
    ----------
    amounts : (c, t) bool or float32
        A: whether each candidate sees each target, or its returns from each road user.
    logarithm : bool
        Whether g is the logarithm.
    positions : (c,) int64
        At most one candidate is chosen at each.
    mandatory : (g, c) bool
        Groups of candidates of which at least one must be chosen.
    budget : float
        Infinite where there is none.
    """

    amounts: NDArray[np.generic]
    logarithm: bool
    weights: Float
    prices: Float
    positions: NDArray[np.int64]
    xyz: Float
    labels: NDArray[np.str_]
    mandatory: Boolean
    forbidden: Boolean
    count: int | None = None
    budget: float = math.inf
    min_distance: float = 0.0

    def value(self, chosen: Sequence[int]) -> float:
        """Return the objective value of chosen candidates."""
        sums = self.amounts[list(chosen)].sum(axis=0, dtype=np.float64)
        return math.fsum(self.weights * (np.log1p(sums) if self.logarithm else sums >= 1))

    def conflict(self) -> Boolean:
        """Return the pairs of which at most one can be chosen, (c, c) bool; the diagonal included."""
        apart = np.hypot(*(self.xyz[:, None, :2] - self.xyz[None, :, :2]).transpose(2, 0, 1))
        return (self.positions[:, None] == self.positions) | (apart < self.min_distance - 1e-6)


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


Integer = NDArray[np.int64]

BLOCK = 1 << 14


def feasible_subsets(case: PlacementCase) -> Integer:
    """Return the subsets that meet every constraint as bit masks, (n,) int64, the empty one included where it does."""
    conflict = case.conflict()
    allowed = np.ones(1, bool)
    # each candidate doubles the subsets: those without it, then those with it
    for candidate in range(len(case.prices)):
        rivals = sum(1 << other for other in range(candidate) if conflict[candidate, other])
        with_it = allowed & ((np.arange(len(allowed)) & rivals) == 0) & ~case.forbidden[candidate]
        allowed = np.concatenate([allowed, with_it])
    subsets = np.flatnonzero(allowed)
    for group in case.mandatory:
        subsets = subsets[(subsets & sum(1 << int(i) for i in np.flatnonzero(group))) != 0]
    members = membership(case, subsets)
    if case.count is not None:
        subsets = subsets[members.sum(axis=1) <= case.count]
    return subsets[membership(case, subsets) @ case.prices <= case.budget * LEAST_EXCESS]


def membership(case: PlacementCase, subsets: Integer) -> Boolean:
    """Return which candidates each subset holds, (n, c) bool."""
    return (subsets[:, None] >> np.arange(len(case.prices)) & 1).astype(bool)


def subset_of(chosen: Integer) -> int:
    """Return the bit mask of chosen candidates."""
    return sum(1 << int(candidate) for candidate in chosen)


def values(case: PlacementCase, subsets: Integer) -> Float:
    """Return the objective value of each subset, (n,) float64; sums of whole weights up to 2^53 are exact."""
    amounts = case.amounts.astype(np.float64)
    result = np.empty(len(subsets))
    for begin in range(0, len(subsets), BLOCK):
        block = slice(begin, begin + BLOCK)
        sums = membership(case, subsets[block]).astype(np.float64) @ amounts
        result[block] = (np.log1p(sums) if case.logarithm else (sums >= 1).astype(np.float64)) @ case.weights
    return result


def cheapest_price(case: PlacementCase, share: float) -> float | None:
    """Return the least price of a feasible subset that covers a share of all weight; None if there is none."""
    subsets = feasible_subsets(case)
    reaching = subsets[values(case, subsets) >= share * math.fsum(case.weights)]
    return float((membership(case, reaching) @ case.prices).min()) if len(reaching) else None


def most_sensors(case: PlacementCase) -> int:
    """Return N, the number of sensors that number, budget and positions allow, whatever spacing and groups do."""
    free = np.flatnonzero(~case.forbidden)
    cheapest = sorted(min(case.prices[free[case.positions[free] == one]]) for one in set(case.positions[free].tolist()))
    affordable = int(np.count_nonzero(np.cumsum(cheapest) <= case.budget * LEAST_EXCESS))
    return min(len(cheapest), max(1, affordable), math.inf if case.count is None else case.count)


def risks(
    case: PlacementCase, views: Sequence[NDArray[np.generic]], tail: float, failure: str
) -> tuple[Integer, Float]:
    """Return the feasible subsets and the risk measure of each, (n,) float64.

    Parameters
    ----------
    views : sequence of (c, t) bool or float32
        Amounts in each scenario.
    tail : float
        Share of the worst scenarios whose outcomes are averaged, at least one.
    failure : {"none", "worst", "mean"}
        The outcome of a scenario is its value, or what is left of it after one sensor has failed: the most important
        one, or each of the N allowed ones on average, where those that are not chosen have no value.
    """
    every, number = np.arange(1 << len(case.prices)), most_sensors(case)
    outcomes = np.empty((len(views), len(every)))
    for scenario, view in enumerate(views):
        whole = values(replace(case, amounts=view), every)
        left, lost = (whole if failure == "none" else np.where(every == 0, 0.0, math.inf)), np.zeros(len(every))
        for candidate in range(len(case.prices)) if failure != "none" else ():
            holds = (every >> candidate & 1).astype(bool)
            after = whole[every & ~(1 << candidate)]
            left = np.where(holds, np.minimum(left, after), left)
            lost += np.where(holds, whole - after, 0.0)
        outcomes[scenario] = whole - lost / number if failure == "mean" else left
    subsets = feasible_subsets(case)
    counted = max(1, math.ceil(tail * len(views) - 1e-9))
    return subsets, np.sort(outcomes[:, subsets], axis=0)[:counted].mean(axis=0)


TIE = 1e-9
"""What the project says counts as equal: a share of all weight, and of the price."""

UNPROVEN = "not proven"
"""No fault, but to be rare."""

RISKS = [(tail, failure) for tail in (1.0, 0.25, 0.0) for failure in ("none", "mean", "worst")]


def problem_of(case: PlacementCase) -> PlacementProblem:
    return PlacementProblem(
        amounts=case.amounts,
        weights=case.weights,
        g=LOG_RETURNS if case.logarithm else COVERAGE,
        prices=case.prices,
        positions=case.positions,
        xyz=case.xyz,
        labels=case.labels,
        mandatory=case.mandatory,
        mandatory_names=np.array([f"group {number}" for number in range(len(case.mandatory))]),
        forbidden=case.forbidden,
        count=case.count,
        budget=None if math.isinf(case.budget) else case.budget,
        min_distance=case.min_distance,
    )


def faults_of_solve(seed: int) -> list[str]:
    """Return what is wrong with the best placement, searched with the usual effort and with almost none."""
    _, case = draw_case(seed)
    subsets = feasible_subsets(case)
    worth = values(case, subsets)
    found = []
    for limits in (DEFAULT_LIMITS, SolverLimits(effort=1e-6)):
        try:
            answer = finish(solve(problem_of(case), limits))
        except SeipError as refusal:
            return [*found, f"refused: {refusal}"] if (worth > 0).any() else found
        found += _faults(answer, case, subsets, worth, exact=True, best=limits is DEFAULT_LIMITS)
    return found


def faults_of_risk(seed: int) -> list[str]:
    """Return what is wrong with the best placement over random scenarios, by one of the risk measures."""
    _, case = draw_case(seed, 13)
    tail, failure = RISKS[(seed + seed // len(RISKS)) % len(RISKS)]  # each with each kind in turn
    if failure != "none" and most_sensors(case) < 2:
        return []
    views = _views(case, np.random.default_rng((45, seed)))
    subsets, worth = risks(case, views, tail, failure)
    try:
        answer = finish(solve(problem_of(case), cases=views, risk=Risk(tail, failure)))
    except SeipError as refusal:
        return [f"refused: {refusal}"] if (worth > 0).any() else []
    return _faults(answer, case, subsets, worth)


def _views(case: PlacementCase, rng: np.random.Generator) -> list[np.ndarray]:
    """Return the amounts of 1 to 8 scenarios, which differ from the nominal ones here and there."""
    shape = (int(rng.integers(1, 9)), *case.amounts.shape)
    changed = rng.random(shape) < rng.choice([0.05, 0.3])
    if not case.logarithm:
        return list(case.amounts ^ changed)
    return list(np.where(changed, rng.choice([0.0, 0.5, 3.0], shape) * case.amounts, case.amounts).astype(np.float32))


def faults_of_cheapest(seed: int) -> list[str]:
    """Return what is wrong with the cheapest placement that covers a share."""
    _, case = draw_case(seed, 16, coverage_only=True)
    share = float(np.random.default_rng((46, seed)).choice([0.1, 0.3, 0.5, 0.75, 0.9]))
    subsets = feasible_subsets(case)
    worth, whole = values(case, subsets), math.fsum(case.weights)
    if (np.abs(worth - share * whole) < 2 * TIE * whole).any():
        return []  # rounding decides what reaches the share
    least = cheapest_price(case, share)
    try:
        answer = finish(cheapest_for_share(problem_of(case), share, DEFAULT_LIMITS))
    except SeipError as refusal:
        return [] if least is None else [f"refused: {refusal}"]
    if least is None:
        return ["a placement for a share that cannot be reached"]
    found = [] if subset_of(answer.chosen) in subsets[worth >= share * whole] else ["not feasible, or below the share"]
    price = math.fsum(case.prices[answer.chosen])
    if not math.isclose(price, answer.objective, rel_tol=TIE, abs_tol=TIE):
        found.append(f"the objective {answer.objective} is not the price {price}")
    if answer.bound > least * (1 + TIE):
        found.append(f"the bound {answer.bound} is above the least price {least}")
    if price > least * (1 + TIE):
        found.append(f"costs {price}, where {least} suffices; called {answer.status}")
    return [*found, *([] if answer.status == "optimal" else [UNPROVEN])]


def _faults(
    answer: Placement,
    case: PlacementCase,
    subsets: np.ndarray,
    worth: np.ndarray,
    *,
    exact: bool = False,
    best: bool = True,
) -> list[str]:
    """Compare a placement of largest value with the values of all feasible subsets.

    Sums of whole weights are compared exactly where that is promised, other values to the stated tolerance. With
    ``best`` the placement must be the best one, whether it is proven or not.
    """
    if len(set(answer.chosen.tolist())) < len(answer.chosen):
        return ["a candidate is chosen twice"]
    place = np.flatnonzero(subsets == subset_of(answer.chosen))
    if not len(place):
        return ["not feasible"]
    most, value = float(worth.max()), float(worth[place[0]])
    slack = 0.0 if exact and _is_whole(case) else TIE * math.fsum(case.weights)
    rounding = 1e-14 * most
    found = []
    if abs(answer.objective - value) > rounding + slack:
        found.append(f"the objective {answer.objective!r} is not the value {value!r}")
    if answer.bound < most - slack - rounding:
        found.append(f"the bound {answer.bound!r} is below {most!r}")
    if (best or answer.status == "optimal") and value < most - slack - rounding:
        found.append(f"has {value!r}, where {most!r} is possible; called {answer.status}")
    if answer.status == "optimal" and not (answer.bound == answer.objective and answer.gap == 0):
        found.append(f"called optimal with the bound {answer.bound!r} and the gap {answer.gap!r}")
    if best and answer.status != "optimal":
        found.append(UNPROVEN)
    return found


def _is_whole(case: PlacementCase) -> bool:
    return not case.logarithm and (case.weights == np.rint(case.weights)).all() and case.weights.sum() < 2**52
