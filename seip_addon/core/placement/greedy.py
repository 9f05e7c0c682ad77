"""Greedy choice with its certificate, and improvement by exchange."""

from __future__ import annotations

import math

import numpy as np

from ..arrays import Boolean, Integer
from .bounds import select
from .instance import SLACK, Instance
from .problem import TIE

SINGLE = 1e-6
"""Relative error of a sum of positive numbers in single precision, with room to spare."""


def greedy(
    instance: Instance, start: Integer, *, per_price: bool = False, enough: float = math.inf
) -> tuple[Integer, float]:
    """Add the candidate of largest gain until nothing that is allowed gains.

    Parameters
    ----------
    instance : Instance
    start : (s,) int64
        Candidates that are chosen already, for instance for the mandatory groups.
    per_price : bool
        Whether gains are divided by prices (for budgets).
    enough : float
        Covered weight at which to stop.

    Returns
    -------
    (k,) int64
        The choice, ascending.
    float
        An upper bound on the covered weight of any placement: the smallest,
        over all steps, of what is covered and the best gains on top of it
        (Leskovec et al. 2007, section 3.2).
    """
    chosen, bound = start, instance.total
    while True:
        uncovered = ~instance.visible[chosen].any(axis=0)
        gain = (instance.matrix @ (instance.weight * uncovered).astype(np.float32)).astype(np.float64)
        bound = min(bound, (instance.covered(chosen) + select(instance, gain).value) * (1 + SINGLE))
        gain[~addable(instance, chosen)] = 0.0
        score = gain / np.maximum(instance.price, TIE * instance.price.max()) if per_price else gain
        best = int(np.argmax(score))
        if gain[best] <= 0 or instance.covered(chosen) >= enough:
            return np.sort(chosen), bound
        chosen = np.append(chosen, best)


def greedy_and_exchange(instance: Instance, start: Integer) -> Integer:
    """Return the best of the greedy choices after exchanges, ascending."""
    by_price = [False, True] if math.isfinite(instance.budget) and instance.price.max() > 0 else [False]
    choices = [exchange(instance, greedy(instance, start, per_price=per_price)[0]) for per_price in by_price]
    return max(choices, key=instance.covered)


def exchange(instance: Instance, chosen: Integer) -> Integer:
    """Swap one sensor for another, and add sensors, for as long as coverage grows."""
    while True:
        chosen = greedy(instance, chosen)[0]
        swapped = _best_swap(instance, chosen)
        if instance.covered(swapped) <= instance.covered(chosen) + SLACK:
            return chosen
        chosen = swapped


def without_idle(instance: Instance, chosen: Integer, goal: float) -> Integer:
    """Take away sensors, the dearest first, that neither the coverage to reach nor a mandatory group needs."""
    for candidate in chosen[np.argsort(-instance.price[chosen], kind="stable")]:
        rest = chosen[chosen != candidate]
        if instance.mandatory[:, rest].any(axis=1).all() and instance.covered(rest) >= goal - SLACK:
            chosen = rest
    return chosen


def without_weakest(instance: Instance, chosen: Integer) -> Integer:
    """Take away the sensor that is missed least."""
    return max((chosen[chosen != candidate] for candidate in chosen), key=instance.covered)


def addable(instance: Instance, chosen: Integer) -> Boolean:
    """Return which candidates can join the chosen ones within all constraints, (c,) bool."""
    if len(chosen) >= instance.count:
        return np.zeros(len(instance), bool)
    room: Boolean = ~instance.conflict[chosen].any(axis=0)
    room[chosen] = False
    room &= instance.affordable(math.fsum(instance.price[chosen]) + instance.price)
    unserved = ~instance.mandatory[:, chosen].any(axis=1)
    room &= instance.mandatory[unserved].all(axis=0)
    return room


def _best_swap(instance: Instance, chosen: Integer) -> Integer:
    """Return the choice after the one exchange that covers most."""
    times = instance.visible[chosen].sum(axis=0)
    rests = [chosen[chosen != candidate] for candidate in chosen]
    uncovered = np.array([(times - instance.visible[candidate]) == 0 for candidate in chosen])
    gain = instance.matrix @ (uncovered * instance.weight).T.astype(np.float32)
    loss = (uncovered * instance.weight).sum(axis=1)
    gain -= loss.astype(np.float32)
    for column, rest in zip(gain.T, rests, strict=True):
        column[~addable(instance, rest)] = -np.inf
    new, gone = np.unravel_index(int(np.argmax(gain)), gain.shape)
    if not np.isfinite(gain[new, gone]):
        return chosen
    return np.sort(np.append(rests[int(gone)], int(new)))
