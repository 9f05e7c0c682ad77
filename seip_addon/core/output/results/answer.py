"""The answer of a placement in short sentences: quality, price, recommendation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from functools import cache

from ...base.counts import counted
from ...choosing.placement.objective import ACCEPTED_MESSAGE, MOVED, purpose
from ...choosing.placement.returns_summary import FEW_RETURNS, returns_text, share_reached
from ...site.installed_cost import InstalledCost, load_installed_cost
from .placement_record import PlacementRecord

LARGE_GAP = 0.05
"""Possible improvement from which a longer search is recommended."""
WHOLE_THOUSANDS = 10_000.0
"""Price in dollars from which a header rounds to thousands."""
SENSOR, CENT = "sensor", 0.01  # name of the first item of costs; dollars to which prices are rounded
NEEDLESS = 0.01
"""Share of the road, lost without a sensor, below which leaving that sensor out is recommended."""


def sentence(text: str) -> str:
    """Return a note with a capital and a full stop; names of types and files at its beginning stay as they are."""
    first = text.split(maxsplit=1)[0] if text.strip() else ""
    begun = text[:1].upper() + text[1:] if first.isalpha() else text
    return begun if begun.endswith((".", "!", "?")) else f"{begun}."


def dollars(amount: float) -> str:
    """Return an amount in whole dollars."""
    return f"${amount:,.0f}"


def date(created: str) -> str:
    """Return the date of a time (ISO 8601), such as 24 November 2026."""
    when = datetime.fromisoformat(created)
    months = ("January", "February", "March", "April", "May", "June", "July", "August", "September", "October")
    return f"{when.day} {(*months, 'November', 'December')[when.month - 1]} {when.year}"


def status_text(record: PlacementRecord) -> str:
    """Return quality, price and certificate in a few words: ``94% · $48k · proven``."""
    price = record.price_usd
    rounded = f"${price / 1000:,.0f}k" if price >= WHOLE_THOUSANDS else dollars(price)
    more, status = possible_improvement(record), record.objective.status
    unproven = "not proven" if more is None else f"within {more:.1%}"
    certificate = {MOVED: "not optimised", "optimal": "proven"}.get(status, unproven)
    return " · ".join((_quality(record), rounded, certificate))


def answer(record: PlacementRecord) -> tuple[str, ...]:
    """Return the achievement of a placement and how much better it could be, its price, and any recommendation."""
    if record.returns is None:
        achieved = f"{record.coverage.whole:.1%} of the road is seen."
    else:
        typical = f"{_quality(record)} from a road user in each revolution: {record.returns.describe_each()}."
        achieved = " ".join(filter(None, (record.returns.verdict(), typical)))
    paid = f"{dollars(record.price_usd)} for {counted(len(record.sensors), 'sensor')}"
    installed = " with installation" if record.installed else f", about {dollars(costs_of(record).total)} installed"
    lines = [f"{achieved} {outlook(record)}", f"{paid}{installed}."]
    judged = () if record.judgement is None else record.judgement.sentences()
    return tuple(filter(None, (*lines, *judged, recommendation(record))))


def outlook(record: PlacementRecord) -> str:
    """Return how much better the best placement of these candidates could be."""
    objective = record.objective
    if objective.status == MOVED:
        return "This is not an optimised placement: the sensors are evaluated where they stand."
    what = purpose(record.notes) if record.returns is None else ""  # else the sentence before has said it
    better = "cheaper" if objective.cheapest else "better"
    if objective.status == "optimal":
        return f"By the criterion, no placement of these candidates is {better}{what}."
    what += "" if record.judgement is None else " by the criterion"
    more = possible_improvement(record)
    return (
        "How much better it could be is not known."
        if more is None
        else f"At most {more:.1%} {better} is possible{what}."
    )


def recommendation(record: PlacementRecord) -> str:
    """Return the most useful next step to a better or cheaper placement, or "" if none stands out."""
    more = possible_improvement(record)
    if more is not None and more >= LARGE_GAP and record.judgement is None:
        how = "let the search run to its end" if ACCEPTED_MESSAGE in record.notes else "raise the effort"
        return f"Search longer for a better placement: {how}."
    crossing = min(record.returns.crossings, key=lambda one: one.least, default=None) if record.returns else None
    if crossing is not None and crossing.least < FEW_RETURNS:
        return f"Few returns from pedestrians ({returns_text(crossing.least)}) at {crossing.name}: add a sensor there."
    if record.returns is None and len(record.sensors) > 1:
        least = min(record.sensors, key=lambda sensor: sensor.coverage_marginal)
        if least.coverage_marginal < NEEDLESS:
            return f"Leave out {least.id}: without it {least.coverage_marginal:.1%} less of the road is seen."
    return ""


def change_text(record: PlacementRecord, previous: PlacementRecord) -> str:
    """Return whether a placement is better or worse than the previous one, or "" if they cannot be compared.

    Compared are placements on the same number of targets by what both were chosen for, returns from road users or
    coverage; one that was chosen by detection may be worse by the criterion, and better.
    """
    if record.judgement is not None:
        return ""
    comparable = record.counts.targets == previous.counts.targets and record.site.name == previous.site.name
    if not comparable or (record.returns is None) != (previous.returns is None):
        return ""
    now, before = (one.coverage.whole if one.returns is None else one.returns.typical for one in (record, previous))
    if now == before:
        return ""
    word = "Better" if now > before else "Worse"
    figures = f"{_quality(record, exact=True)} instead of {_quality(previous, exact=True)}"
    saved = previous.price_usd - record.price_usd
    price = f", for {dollars(abs(saved))} {'less' if saved > 0 else 'more'}" if round(saved) else ""
    return f"{word} than the previous placement: {figures}{price}."


def possible_improvement(record: PlacementRecord) -> float | None:
    """Return by which share the best placement might be better, or cheaper; None without a bound."""
    objective = record.objective
    if objective.bound is None or objective.status == MOVED:
        return None
    if objective.cheapest:
        return max(0.0, 1.0 - objective.bound / objective.value) if objective.value else 0.0
    of_returns = objective.sought == "most returns"
    share = share_reached(objective.bound, objective.value, of_returns=of_returns)
    return max(0.0, share - 1.0) if math.isfinite(share) else None


def _quality(record: PlacementRecord, *, exact: bool = False) -> str:
    if record.returns is not None:
        return f"{returns_text(record.returns.typical)} returns"
    return f"{record.coverage.whole:.2%}" if exact else f"{record.coverage.whole:.0%}"


@dataclass(frozen=True)
class Costs:
    """Cost items of each sensor in dollars, `SENSOR` first, in the order of the record.

    ``estimated`` is whether the placement was made on the prices of sensors only, and installation is added here.
    """

    items: tuple[Mapping[str, float], ...]
    estimated: bool

    @property
    def sensors(self) -> float:
        """Price of all sensors."""
        return sum(items[SENSOR] for items in self.items)

    @property
    def total(self) -> float:
        """Price of all sensors with their installation."""
        return sum(sum(items.values()) for items in self.items)

    @property
    def by_item(self) -> list[tuple[str, int, float]]:
        """Name, number and sum of each item."""
        names = dict.fromkeys(name for items in self.items for name in items)
        found = [(name, [items[name] for items in self.items if name in items]) for name in names]
        return [(name, len(each), sum(each)) for name, each in found]


def costs_of(record: PlacementRecord) -> Costs:
    """Return the costs of a placement; installation is that of the record, or of the shipped table if it has none."""
    settings = record.request
    table, bracket = settings.installed_cost or _shipped(), settings.candidates.bracket
    costs = []
    for sensor in record.sensors:
        installation, recorded = table.items(on_pole=sensor.on_pole, bracket=bracket), sensor.installation_usd
        if recorded is not None and abs(recorded - sum(installation.values())) > CENT:
            installation = {"installation": recorded}
        costs.append({SENSOR: sensor.price_usd - (recorded or 0.0), **installation})
    return Costs(tuple(costs), not record.installed)


@cache  # the panel asks at every redraw
def _shipped() -> InstalledCost:
    return load_installed_cost()
