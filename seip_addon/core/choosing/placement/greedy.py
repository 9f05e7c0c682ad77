"""Greedy selection with its certificate, and local search by swaps."""

import math
from collections.abc import Generator, Iterable, Iterator

import numpy as np

from ...arrays import Boolean, Float, Integer
from ...progress import Progress
from .bounds import select
from .constraints import Constrained
from .problem import TIE_TOLERANCE
from .reduced_problem import Instance

GREEDY_STARTS = 8  # candidates to begin a greedy choice with, before swaps


def greedy(instance: Instance, start: Integer, *, per_price: bool = False, enough: float = math.inf) -> Integer:
    """Add the candidate of largest gain until no allowed candidate adds anything; return the choice, ascending.

    Parameters
    ----------
    start : (s,) int64
        Candidates that are chosen already, for instance for the mandatory groups.
    per_price : bool
        Whether gains are divided by prices (for budgets).
    enough : float
        Objective value at which to stop.
    """
    *_, chosen = greedy_steps(instance, start, per_price=per_price, enough=enough)
    return np.sort(chosen)


def greedy_steps(
    instance: Instance, start: Integer, *, per_price: bool = False, enough: float = math.inf
) -> Iterator[Integer]:
    """Yield the choice of `greedy` before and after each step, in the order in which candidates were added."""
    chosen = start
    while True:
        yield chosen
        gain = instance.gains(instance.increments(instance.times(chosen)))
        gain[~addable(instance, chosen)] = 0.0
        score = gain / np.maximum(instance.price, TIE_TOLERANCE * instance.price.max()) if per_price else gain
        best = int(np.argmax(score))
        if gain[best] <= 0 or instance.value(chosen) >= enough:
            return
        chosen = np.append(chosen, best)


def greedy_bound(instance: Instance, steps: Iterable[Integer]) -> float:
    """Return an upper bound on the covered weight of any placement, for `COVERAGE`.

    It is the smallest, over all steps, of the weight covered plus the largest gains on top of it (Leskovec et al. 2007,
    section 3.2).
    """
    reached = [
        instance.value(chosen) + select(instance, instance.gains(instance.increments(instance.times(chosen)))).value
        for chosen in steps
    ]
    return min([instance.total, *reached])


def orders(instance: Constrained) -> list[bool]:
    """Return whether to choose greedily by gain per price; under a budget both orders are tried."""
    return [False, True] if math.isfinite(instance.budget) and instance.price.max() > 0 else [False]


def greedy_with_swaps(instance: Instance, start: Integer) -> Generator[Progress, None, Integer]:
    """Return the best of several greedy choices after swaps, ascending.

    Swaps end in a local optimum. So in addition to the greedy choices themselves, those that begin with other
    candidates of large gain are improved too.
    """
    best = start
    for per_price in orders(instance):
        improved = yield from swap_search(instance, greedy(instance, start, per_price=per_price))
        best = max(best, improved, key=instance.value)
    first = np.where(addable(instance, start), instance.gains(instance.increments(instance.times(start))), 0.0)
    for candidate in np.argsort(-first, kind="stable")[1:GREEDY_STARTS]:
        if first[candidate] > 0 and instance.value(best) < instance.total:
            improved = yield from swap_search(instance, np.append(start, candidate))
            best = max(best, improved, key=instance.value)
    return best


def swap_search(instance: Instance, chosen: Integer) -> Generator[Progress, None, Integer]:
    """Swap one sensor for another, and add sensors, for as long as the objective value grows."""
    while True:
        chosen = greedy(instance, chosen)
        if instance.value(chosen) == instance.total:
            return chosen
        yield Progress(0, 0, "swapping sensors")
        gain = swap_gains(instance, chosen)
        if gain.max(initial=0.0) <= instance.slack:
            return chosen
        gone, new = np.unravel_index(int(np.argmax(gain)), gain.shape)
        chosen = np.sort(np.append(np.delete(chosen, gone), new))


def drop_redundant(instance: Instance, chosen: Integer, goal: float) -> Integer:
    """Remove sensors, the most expensive first, that neither the goal nor a mandatory group needs."""
    for candidate in chosen[np.argsort(-instance.price[chosen], kind="stable")]:
        rest = chosen[chosen != candidate]
        if instance.mandatory[:, rest].any(axis=1).all() and instance.value(rest) >= goal - instance.slack:
            chosen = rest
    return chosen


def drop_weakest(instance: Instance, chosen: Integer) -> Integer:
    """Remove the sensor whose loss lowers the value least."""
    return max((chosen[chosen != candidate] for candidate in chosen), key=instance.value)


def addable(instance: Constrained, chosen: Integer) -> Boolean:
    """Return which candidates can join the chosen ones within all constraints, (c,) bool."""
    if len(chosen) >= instance.count:
        return np.zeros(len(instance), bool)
    room: Boolean = ~instance.conflict[chosen].any(axis=0)
    room[chosen] = False
    room &= instance.affordable(math.fsum(instance.price[chosen]) + instance.price)
    unserved = ~instance.mandatory[:, chosen].any(axis=1)
    room &= instance.mandatory[unserved].all(axis=0)
    return room


def swap_gains(instance: Instance, chosen: Integer) -> Float:
    """Return the gain of swapping each chosen candidate for each other one, (k, c); -inf where that is forbidden."""
    return _allowed_gains(instance, chosen, instance.gains(_rests(instance, chosen).T).T)


def _rests(instance: Instance, chosen: Integer) -> Float:
    """Return what one sensor adds to each target after each of the chosen candidates is removed, (k, t) float64."""
    return instance.increments(instance.times(chosen) - instance.visible[chosen])


def _allowed_gains(instance: Instance, chosen: Integer, seen: Float) -> Float:
    """Return `swap_gains` from what each candidate adds to the remaining ones, (k, c)."""
    without = instance.cover.value(instance.times(chosen) - instance.visible[chosen]) @ instance.weight
    gain: Float = seen + (without - instance.value(chosen))[:, None]
    for row, candidate in zip(gain, chosen, strict=True):
        row[~addable(instance, chosen[chosen != candidate])] = -np.inf
    gain[:, chosen] = -np.inf
    return gain
