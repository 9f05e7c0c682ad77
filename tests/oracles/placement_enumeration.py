"""Exact answers to placement problems of up to 20 candidates: all subsets, by NumPy only."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tests.oracles.placement_case import LEAST_EXCESS, Boolean, Float, PlacementCase

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
