"""What is wrong with a solver's answers to random placement problems, by enumeration of all subsets."""

from __future__ import annotations

import math

import numpy as np

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.cheapest import cheapest_for_share
from seip_addon.core.choosing.placement.concave import COVERAGE, LOG_RETURNS
from seip_addon.core.choosing.placement.problem import Placement, PlacementProblem
from seip_addon.core.choosing.placement.risk import Risk
from seip_addon.core.choosing.placement.search_limits import DEFAULT_LIMITS, SolverLimits
from seip_addon.core.choosing.placement.solver import solve
from tests.oracles.placement_case import PlacementCase
from tests.oracles.placement_enumeration import (
    cheapest_price,
    feasible_subsets,
    most_sensors,
    risks,
    subset_of,
    values,
)
from tests.oracles.random_placement_cases import draw_case

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
