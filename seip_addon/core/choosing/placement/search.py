"""Anytime search: greedy choices, swaps, and restarts from a part of good placements of several mixtures of prices.

The greedy algorithm has at least 1 - 1/e (63 %) of the best value if only the number of sensors is limited (Nemhauser,
Wolsey and Fisher 1978). Swaps end where no sensor has a better replacement; restarts lead to other such ends.
"""

from __future__ import annotations

import math
from collections.abc import Generator

import numpy as np

from ...base.arrays import Float, Integer
from ...base.progress import Progress
from .incumbent import Incumbent
from .problem import TIE_TOLERANCE
from .search_limits import OVERHEAD_OPERATIONS

CORE_STEPS, LEAST_CORE = (0.5, 0.5, 0.5, 8.0), 130
"""Cores of candidates among which restarts search in turn: the most promising ones, as many as make a step take these
multiples of what goes on around it, and the least number of them.

The best placements nearly always consist of candidates of large net scores in the linear bound: a small problem (kernel
search: Angelelli, Mansini and Speranza 2010).
"""
PATIENCE = 120
"""Restarts without a better placement after which the search ends, in addition to as many as led to the best one."""
WALK_LOSS, MIXTURE_LOSS = 0.01, 0.02
"""Shares of the best value by which the last placement, and that of another mixture of prices, may be worse."""
RETURN = 10  # restarts between those from the best placement
FIRST_CHOICES = 20  # candidates of largest gain, one of which begins a restart
PRICE_POWERS = (0.0, 0.5, 1.0, 1.5)
"""Powers of the price by which gains are divided: different ones lead to different mixtures of prices."""
RESTART_POWERS = (0.0, 1.0)  # those of restarts

Steps = Generator[Progress, None, None]


class Search:
    """Search for better placements than the incumbent.

    Parameters
    ----------
    incumbent : Incumbent
    start : (s,) int64
        Candidates that serve the mandatory groups.
    seed : int
    among : (n,) int64, optional
        Candidates to search among, ascending; by default all. Those of placements are then indices among these.
    """

    def __init__(self, incumbent: Incumbent, start: Integer, seed: int = 0, among: Integer | None = None) -> None:
        self.incumbent, self.start = incumbent, start
        self.among = np.arange(len(incumbent.instance)) if among is None else among
        self.instance = incumbent.instance if among is None else incumbent.instance.of(among)
        self._random = np.random.default_rng(seed)
        instance = self.instance
        mixed = (math.isfinite(instance.budget) or math.isfinite(incumbent.goal)) and np.ptp(instance.price) > 0
        self.powers = PRICE_POWERS if mixed else (0.0,)
        price = np.maximum(instance.price, TIE_TOLERANCE * max(float(instance.price.max()), TIE_TOLERANCE))
        self._divisors = {power: price**power for power in (*self.powers, 1.0)}

    def first(self) -> Steps:
        """Find a first placement: the best of greedy choices by gain and by gain per price."""
        for power in self.powers:
            chosen = yield from self.filled(self.start, power, "choosing greedily")
            self.incumbent.offer(chosen)
            yield self.incumbent.progress("choosing greedily")
        yield from self._improved(self.incumbent.chosen)

    def adapt(self, known: Integer) -> Steps:
        """Improve a placement of a similar problem: drop the sensors that are too many, add others, and swap."""
        chosen = known
        while len(chosen) and not self._is_within_limits(chosen):
            chosen = self._without_weakest(chosen)
        yield from self._improved((yield from self.filled(chosen, 0.0)))

    def restarts(self, effort: float, rank: Float) -> Steps:
        """Restart from a part of a good placement until that stops improving the best one, or for units of work.

        The placement to leave is the last end of swaps, in turn with the best one of some mixture of prices, if these
        are little worse than the best one of all: so the search moves away from it.

        Parameters
        ----------
        rank : (c,) float64
            Rank of the candidates, largest first, by which restarts limit them.
        """
        incumbent, work, instance = self.incumbent, self.incumbent.work, self.instance
        last = work.left - effort
        number = best_at = 0
        current = incumbent.chosen
        mixtures = {self._mixture(current): (incumbent.value, current)}
        cores = self.cores(rank)
        while number - best_at < PATIENCE + best_at and work.left > max(last, 0.0):
            core = cores[number % len(cores)]
            number += 1
            before = incumbent.value
            found = yield from core.restarted(current)
            value = instance.value(found)
            if value > before + instance.slack:
                found = yield from self._improved(found)
                value = instance.value(found)
                best_at = number if incumbent.value > before + instance.slack else best_at
                if not all(np.isin(incumbent.chosen, one.among).all() for one in cores):
                    cores = self.cores(rank)
            if value > mixtures.get(self._mixture(found), (-math.inf, found))[0]:
                mixtures[self._mixture(found)] = value, found
            current = found if self._is_good(value, WALK_LOSS) and number % RETURN != 0 else incumbent.chosen
            if number % 2 and len(self.powers) > 1:
                good = [one for reached, one in mixtures.values() if self._is_good(reached, MIXTURE_LOSS)]
                current = good[self._random.integers(len(good))]

    def cores(self, rank: Float) -> list[Search]:
        """Return searches among the candidates of highest rank, and those of the best placement."""
        instance, order = self.instance, np.argsort(-rank, kind="stable")
        needed = np.union1d(self.incumbent.chosen, np.flatnonzero(instance.mandatory.any(axis=0)))
        cores: dict[float, Search] = {}
        for steps in dict.fromkeys(CORE_STEPS):
            number = int(steps * OVERHEAD_OPERATIONS / instance.update_operations * len(order))
            among = np.union1d(needed, order[: max(LEAST_CORE, number)])
            cores[steps] = Search(self.incumbent, among[:0], int(self._random.integers(2**32)), among)
        return [cores[steps] for steps in CORE_STEPS]

    def restarted(self, current: Integer) -> Generator[Progress, None, Integer]:
        """Return an end of swaps from a part of a placement, both of candidates of the incumbent's instance."""
        found = yield from self._swapped((yield from self._restarted(np.flatnonzero(np.isin(self.among, current)))))
        return self.among[found]

    def _is_good(self, value: float, loss: float) -> bool:
        """Return whether a value is worse than the best one by no more than a share."""
        return value >= self.incumbent.value - loss * abs(self.incumbent.value)

    def _mixture(self, chosen: Integer) -> tuple[float, ...]:
        """Return the prices of sensors in ascending order."""
        return tuple(np.sort(self.instance.price[chosen]).tolist())

    def _restarted(self, best: Integer) -> Generator[Progress, None, Integer]:
        """Drop a random part of a placement, add another candidate, and fill up greedily."""
        random, instance = self._random, self.instance
        number = min(len(best), random.integers(1, (len(best) + 1) // 2 + 1, endpoint=True))
        dropped = random.choice(best, number, replace=False) if number else best
        kept = np.setdiff1d(best, dropped)
        power = RESTART_POWERS[random.integers(len(RESTART_POWERS))] if len(self.powers) > 1 else 0.0
        gain = np.where(instance.addable(kept), self._rated(kept, power), -np.inf)
        gain[dropped] = -np.inf
        first = np.argsort(-gain, kind="stable")[:FIRST_CHOICES]
        first = first[np.isfinite(gain[first])]
        if len(first):
            kept = np.append(kept, random.choice(first))
        return (yield from self.filled(kept, power))

    def filled(
        self, chosen: Integer, power: float, phase: str = "improving the placement"
    ) -> Generator[Progress, None, Integer]:
        """Add the candidate of largest gain, by a power of the price, until none is left or the goal is reached."""
        instance, goal = self.instance, self.incumbent.goal
        while (self.incumbent.work.left > 0 or self.incumbent.value == -math.inf) and (
            goal == -math.inf or instance.value(chosen) < goal
        ):
            addable = instance.addable(chosen)
            if not addable.any():
                break
            rate = np.where(addable, self._rated(chosen, power), -np.inf)
            best = int(np.argmax(rate))
            if rate[best] <= 0 and instance.mandatory[:, chosen].any(axis=1).all():
                break
            chosen = np.append(chosen, best)
            yield self.incumbent.progress(phase)
        return chosen

    def _rated(self, chosen: Integer, power: float) -> Float:
        self.incumbent.work.spend(self.instance.update_operations)
        rated: Float = self.instance.gains(chosen) / self._divisors[power]
        return rated

    def _improved(self, chosen: Integer) -> Generator[Progress, None, Integer]:
        """Swap sensors until no swap helps, and offer the result."""
        chosen = yield from self._swapped(chosen)
        self.incumbent.offer(chosen)
        return chosen

    def _swapped(self, chosen: Integer) -> Generator[Progress, None, Integer]:
        """Replace one sensor after the other by the best candidate, for as long as the value grows."""
        instance, work = self.instance, self.incumbent.work
        value, still, slot = instance.value(chosen), 0, 0
        while still < len(chosen) and work.left > 0:
            slot = (slot + 1) % len(chosen)
            rest = np.delete(chosen, slot)
            values = np.where(instance.addable(rest), instance.values_with(rest), -np.inf)
            work.spend(instance.update_operations * (len(chosen) if instance.risk.failure != "none" else 1))
            swapped = np.insert(rest, slot, int(np.argmax(values)))
            still += 1
            if values.max() > value and (reached := instance.value(swapped)) > value + instance.slack:
                # what a cheaper sensor leaves of the budget may buy another one
                chosen = yield from self.filled(swapped, 0.0)
                value, still = (reached if len(chosen) == len(swapped) else instance.value(chosen)), 0
            yield self.incumbent.progress("improving the placement")
        return chosen

    def _is_within_limits(self, chosen: Integer) -> bool:
        price = math.fsum(self.instance.price[chosen])
        return len(chosen) <= self.instance.count and bool(self.instance.affordable(price))

    def _without_weakest(self, chosen: Integer) -> Integer:
        """Remove the sensor whose loss lowers the value least."""
        return max((chosen[chosen != one] for one in chosen), key=self.instance.value)


def without_idle(incumbent: Incumbent, least: float | None = None) -> Integer:
    """Return the best placement without sensors, the dearest first, that neither value nor mandatory groups need.

    Parameters
    ----------
    least : float, optional
        Value that must remain; by default that of the placement.
    """
    instance, chosen = incumbent.instance, incumbent.chosen
    least = incumbent.value if least is None else least
    for one in chosen[np.argsort(-instance.price[chosen], kind="stable")]:
        rest = chosen[chosen != one]
        if instance.feasible(rest) and instance.value(rest) >= least - instance.slack:
            chosen = rest
    return chosen
