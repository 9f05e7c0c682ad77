"""Tabu search of swaps, once for each composition of sensor types that a budget allows.

Where a budget is spent, a swap exchanges a sensor for one of about the same price only: the numbers of cheap and of
expensive sensors, the composition, stay as they are. So each composition that spends the budget is searched separately.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace

import numpy as np

from ...arrays import Boolean, Float, Integer
from ...progress import Progress
from .greedy import greedy_steps
from .problem import TIE_TOLERANCE
from .reduced_problem import Instance
from .search_limits import Clock

SHORT_PATIENCE, LONG_PATIENCE = 60, 50
"""Swaps without a better choice that end a tabu search: in a short one, and for each sensor in a long one."""

SEARCHED_AGAIN = 5  # compositions with a long search; if there are no more than these, short ones are skipped
MAX_COMPOSITIONS = 30  # largest number of compositions that are searched, the most promising ones

RENEWAL_INTERVAL, RENEWED_SHARE = 120, 0.3  # swaps without a better choice, and share of the sensors replaced then

ADDED_TENURE, DROPPED_TENURE = 4, 12
"""A candidate that was added cannot be dropped for fewer steps than the first number, drawn at random; one that was
dropped cannot return for one to two times the second.
"""

MAX_TIERS = 3  # largest number of price tiers: the number of compositions grows with each
TIER_RATIO = 1.25  # prices that differ by less than this factor are in one tier
STEP_OPERATIONS = 3e6  # multiplications that take as long as the rest of a step
OPERATIONS_PER_ENTRY = 60  # multiplications that take as long as updating one sum of gains


class SwapGains:
    """Change of the objective value by each swap, updated incrementally after every swap.

    If candidate c replaces the sensor of slot s, the value changes by ``base[c] + back[s, c]`` minus the same sum for
    the replaced sensor. Here ``base[c]`` is the gain of c on top of all chosen sensors, and ``back[s, c]`` is the
    increase of that gain when the sensor of s is gone. Both are sums over targets, of which a swap changes few: only
    the candidates that see these are updated. All sums are whole numbers.

    Parameters
    ----------
    chosen : (k,) int64
        Candidates to begin with.

    Attributes
    ----------
    slots : (k or k + 1,) int64
        Chosen sensors; -1 at the end is an empty slot, where one more sensor may be added.
    value : float
        Objective value of the chosen sensors.
    work : float
        Number of multiplications that take as long as the updates so far.
    """

    def __init__(self, instance: Instance, chosen: Integer) -> None:
        self.instance = instance
        self.slots = np.zeros(0, dtype=np.int64)
        self.work = 0.0
        # For a target seen n times: what one sensor more adds (`_rise`), and how much more that sensor would add if one
        # of the n were gone (`_fall`, zero for n = 0, where none can go). `base` and `back` are sums of these.
        seen = np.arange(instance.count + 2)
        self._rise = np.diff(instance.cover.value(seen)).astype(np.float64)
        self._fall = np.concatenate(([0.0], -np.diff(self._rise)))
        self._times = np.zeros(len(instance.weight), dtype=np.int64)
        self._per_target = np.zeros((1, len(instance.weight)))
        self._sums = np.zeros((1, len(instance)))
        self._update(np.arange(len(instance.weight)))
        self._open_slot()
        for candidate in chosen.tolist():
            self.swap(len(self.slots) - 1, candidate)

    @property
    def chosen(self) -> Integer:
        """The sensors chosen, ascending."""
        return np.sort(self.slots[self.slots >= 0])

    @property
    def value(self) -> float:
        """Objective value of the sensors chosen."""
        return float(self.instance.weight @ self.instance.cover.value(self._times))

    @property
    def gains(self) -> Float:
        """Change of the objective value if each candidate replaces each slot's sensor, (slots, c)."""
        base, back = self._sums[0], self._sums[1:]
        gain: Float = base + back
        # The replaced sensor itself is a candidate for its slot: putting it back gives the value of today, so that its
        # entry is what is lost by removing it.
        gain -= np.where(self.slots >= 0, gain[np.arange(len(self.slots)), self.slots], 0.0)[:, None]
        return gain

    def swap(self, slot: int, candidate: int) -> None:
        """Put a candidate in place of a slot's sensor, or into the empty slot."""
        visible, gone = self.instance.visible, int(self.slots[slot])
        changed = visible[candidate].copy()
        self._times += visible[candidate]
        if gone >= 0:
            changed |= visible[gone]
            self._times -= visible[gone]
        self.slots[slot] = candidate
        self._update(np.flatnonzero(changed))
        if gone < 0:
            self._open_slot()

    def _open_slot(self) -> None:
        if len(self.slots) < self.instance.count:
            self.slots = np.append(self.slots, -1)
            self._per_target = np.concatenate((self._per_target, np.zeros((1, len(self.instance.weight)))))
            self._sums = np.concatenate((self._sums, np.zeros((1, len(self.instance)))))

    def _update(self, targets: Integer) -> None:
        """Update the sums after the number of sensors that see some targets has changed."""
        instance, times = self.instance, self._times[targets]
        weight = instance.weight[targets]
        now = np.zeros((len(self._per_target), len(targets)))
        now[0] = weight * self._rise[times]
        filled = np.flatnonzero(self.slots >= 0)
        now[filled + 1] = weight * self._fall[times] * instance.visible[np.ix_(self.slots[filled], targets)]
        change = now - self._per_target[:, targets]
        self._per_target[:, targets] = now
        # Every changed summand is added to the sums of all candidates that see its target. `seen_by` lists these target
        # by target in one array; the index arithmetic below joins the lists of the changed targets without a loop.
        row, column = np.nonzero(change)
        first, candidates = instance.seen_by
        number = (first[1:] - first[:-1])[targets[column]]
        # entry e of a changed target is the e-th of the candidates that see it
        entry = np.arange(number.sum()) - np.repeat(np.cumsum(number) - number, number)
        candidate = candidates[np.repeat(first[targets[column]], number) + entry]
        index = np.repeat(row * len(instance), number) + candidate
        added = np.bincount(index, np.repeat(change[row, column], number), self._sums.size)
        self._sums += added.reshape(self._sums.shape)
        self.work += OPERATIONS_PER_ENTRY * float(len(entry)) + change.size + self._sums.size


def composition_search(
    instance: Instance, start: Integer, chosen: Integer, clock: Clock
) -> Generator[Progress, None, Integer]:
    """Improve a choice by tabu search, under a budget for each composition of sensors that spends it.

    Parameters
    ----------
    start : (s,) int64
        Candidates that each composition begins with, for instance for the mandatory groups.
    chosen : (k,) int64
        Known placement.

    Returns
    -------
    (k,) int64
        Placement that is at least as good.
    """
    tier = price_tiers(instance)
    unlimited = np.full(int(tier.max()) + 1, instance.count)
    spends = len(unlimited) > 1 and math.isfinite(instance.budget)
    rooms = compositions(instance, tier) if spends else [unlimited]
    beginnings = [(start, room) for room in rooms if (np.bincount(tier[start], minlength=len(room)) <= room).all()]
    found = [(chosen, unlimited), *beginnings]
    # With many compositions, a short search of each decides which of them deserve a long one.
    if len(found) > SEARCHED_AGAIN:
        for number, (beginning, room) in enumerate(found):
            found[number] = (yield from tabu_search(instance, beginning, clock, SHORT_PATIENCE, tier, room)), room
        found.sort(key=lambda one: -instance.value(one[0]))  # of equal ones the first stays first
    best = [one[0] for one in found]
    for beginning, room in found[:SEARCHED_AGAIN]:
        best.append((yield from tabu_search(instance, beginning, clock, LONG_PATIENCE * instance.count, tier, room)))
    return max(best, key=instance.value)


def tabu_search(  # where it begins, and its limits
    instance: Instance, chosen: Integer, clock: Clock, patience: int, tier: Integer, room: Integer
) -> Generator[Progress, None, Integer]:
    """Make the best swap repeatedly, even if it lowers the value, and return the best choice found (Glover 1989).

    A sensor that was dropped cannot return for a while, and one that was added cannot be dropped, unless that leads to
    a choice better than any before. From time to time the search returns to the best choice and replaces some of its
    sensors, drawn at random from a fixed seed, to leave the neighbourhood of that choice.

    Parameters
    ----------
    patience : int
        Swaps in a row without a better choice that end the search.
    tier : (c,) int64
        Price tier of each candidate.
    room : (tiers,) int64
        Largest number of sensors of each tier.
    """
    swaps = SwapGains(instance, chosen)
    # `most` is the value of the best choice and `better_at` its step; `locked` the step up to which each candidate is
    # tabu, whether it was added or dropped.
    best, most, better_at, step = swaps.chosen, swaps.value, 0, 0
    value = most
    locked = np.zeros(len(instance), np.int64)
    random = np.random.default_rng(0)
    while step <= better_at + patience and clock.left > 0 and most < instance.total:
        step += 1
        yield Progress(0, 0, "searching swaps")
        # Renewal: some sensors of the best choice are dropped and locked out, so that the steps below refill their
        # slots with others. It is skipped where mandatory groups need the dropped sensors.
        if (step - better_at) % RENEWAL_INTERVAL == 0:
            gone = random.choice(best, math.ceil(RENEWED_SHARE * len(best)), replace=False)
            rest = np.setdiff1d(best, gone)
            if instance.mandatory[:, rest].any(axis=1).all():
                swaps = SwapGains(instance, rest)
                locked[gone] = step + random.integers(DROPPED_TENURE, 2 * DROPPED_TENURE, len(gone))
                value = swaps.value
        gain = np.where(_allowed(instance, swaps.slots, tier, room), swaps.gains, -np.inf)
        # Tabu swaps are those of a locked candidate or a locked sensor. Aspiration: one that leads to a choice better
        # than the best is allowed nevertheless.
        filled = swaps.slots >= 0
        locked_in = filled & (locked[swaps.slots] > step)
        gain[((locked > step) | locked_in[:, None]) & (value + gain <= most + instance.slack)] = -np.inf
        adding = len(gain) > 0 and not filled[-1] and gain[-1].max() > 0
        if adding:  # an empty slot is filled before any swap: one sensor more is no worse than what a swap could add
            gain[:-1] = -np.inf
        slot, came = np.unravel_index(int(np.argmax(gain)), gain.shape) if gain.size else (0, 0)
        # No swap is allowed: wait for locks to expire, or end where there are none.
        if gain.size == 0 or not np.isfinite(gain[slot, came]):
            if not (locked > step).any():
                break
            continue
        went, before = int(swaps.slots[slot]), swaps.work
        locked[came] = step + random.integers(1, ADDED_TENURE)
        if went >= 0:
            locked[went] = step + random.integers(DROPPED_TENURE, 2 * DROPPED_TENURE)
        swaps.swap(int(slot), int(came))
        clock.spend(swaps.work - before + STEP_OPERATIONS)
        value = swaps.value
        if value > most:
            best, most, better_at = swaps.chosen, value, step
    return best


def price_tiers(instance: Instance) -> Integer:
    """Return the price tier of each candidate, (c,) int64; tiers end where prices differ most."""
    # The widest relative gaps between successive prices separate the tiers. The maximum keeps a price of zero out of
    # the division.
    price = np.unique(instance.price)
    ratio = price[1:] / np.maximum(price[:-1], TIE_TOLERANCE * max(float(price[-1]), TIE_TOLERANCE))
    widest = np.argsort(-ratio, kind="stable")[: MAX_TIERS - 1]
    starts = np.sort(price[1:][widest[ratio[widest] >= TIER_RATIO]])
    return np.searchsorted(starts, instance.price, side="right")


def compositions(instance: Instance, tier: Integer) -> list[Integer]:
    """Return the numbers of sensors of each tier that spend the budget, (tiers,) int64 each, the most promising first.

    For each combination of expensive sensors, the number of sensors of the cheapest tier is the largest that the budget
    and the limit on sensors then allow. If there are more compositions than `MAX_COMPOSITIONS`, each is rated by the
    coverage of greedy choices within each tier, as if coverage of tiers were independent.
    """
    # The least price of each tier gives the largest number of its sensors. Prices are raised to at least the one at
    # which ``count`` + 1 sensors use up the budget: that changes no result, and free sensors do not divide by zero.
    cheapest = np.array([instance.price[tier == number].min() for number in range(int(tier.max()) + 1)])
    budget = instance.budget * (1 + TIE_TOLERANCE)
    most = np.minimum(budget // np.maximum(cheapest, budget / (instance.count + 1)), instance.count).astype(np.int64)
    dear = np.stack(np.meshgrid(*(np.arange(number + 1) for number in most[1:]), indexing="ij"), axis=-1)
    dear = dear.reshape(-1, len(most) - 1)
    left = budget - dear @ cheapest[1:]
    cheap = np.minimum(left // max(cheapest[0], budget / (instance.count + 1)), instance.count - dear.sum(axis=1))
    rooms = np.column_stack((cheap.astype(np.int64), dear))[(left >= 0) & (cheap >= 0)]
    # Compositions within a larger one are searched with it. Of too many, the rating multiplies the shares that the
    # tiers miss: that is the share missed by all if what they cover were independent.
    rooms = np.array([room for room in rooms if not _outdone(room, rooms)])
    if len(rooms) > MAX_COMPOSITIONS:
        missed = np.ones(len(rooms))
        for number, most_of_tier in enumerate(most):
            missed *= 1 - _greedy_shares(instance, np.flatnonzero(tier == number), most_of_tier)[rooms[:, number]]
        rooms = rooms[np.argsort(missed, kind="stable")[:MAX_COMPOSITIONS]]
    return list(rooms)


def _outdone(room: Integer, rooms: Integer) -> bool:
    """Whether another composition has at least the same number of sensors in each tier, and more in one."""
    return bool(((rooms >= room).all(axis=1) & (rooms > room).any(axis=1)).any())


def _greedy_shares(instance: Instance, members: Integer, most: int) -> Float:
    """Return the share of all weight that greedy choices of 0, 1, … of some candidates cover, (most + 1,) float64."""
    part = replace(instance.of(members), count=int(most), budget=math.inf, mandatory=np.zeros((0, len(members)), bool))
    shares = [part.value(chosen) / instance.total for chosen in greedy_steps(part, np.zeros(0, np.int64))]
    return np.array(shares + shares[-1:] * (int(most) + 1 - len(shares)))


def _allowed(instance: Instance, slots: Integer, tier: Integer, room: Integer) -> Boolean:
    """Return which candidates may replace each slot's sensor within all constraints, (slots, c) bool."""
    # One pass over arrays in place of a check of each swap: conflicts, budget, tiers, mandatory groups.
    filled = slots[slots >= 0]
    rows = np.zeros((len(slots), len(instance)), dtype=bool)
    rows[slots >= 0] = instance.conflict[filled]
    # no conflicts at all (0 == False), or exactly one, with the sensor that goes (1 == True)
    allowed: Boolean = rows.sum(axis=0) == rows
    price = np.where(slots >= 0, instance.price[slots], 0.0)
    allowed &= np.asarray(instance.affordable((price.sum() - price)[:, None] + instance.price))
    number = np.bincount(tier[filled], minlength=len(room))
    freed = np.where(slots >= 0, tier[slots], -1)[:, None] == np.arange(len(room))
    allowed &= (number - freed < room)[:, tier]
    served = instance.mandatory[:, filled]
    for slot in range(len(slots) if len(served) else 0):
        # without this slot's sensor some groups may have none: the candidate must be in all of these
        unserved = ~np.delete(served, slot, axis=1).any(axis=1) if slot < len(filled) else ~served.any(axis=1)
        allowed[slot] &= instance.mandatory[unserved].all(axis=0)
    allowed[:, filled] = False
    return allowed
