"""Sentences of a report: what was proven, warnings in plain words, positions and dates."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from datetime import datetime

from ...base.counts import counted
from ...choosing.placement.objective import CHOSEN_FOR, MOVED, MOVED_MESSAGE, Objective
from ...sensing.lidar.catalogue import load_catalogue
from ..results.answer import possible_improvement, sentence
from ..results.placement_record import RecordedSensor
from .evidence import Evidence


def dollars(amount: float) -> str:
    """Return an amount in whole dollars."""
    return f"${amount:,.0f}"


def points(share: float) -> str:
    """Return a share as percentage points, rounded up."""
    return f"{math.ceil(share * 1000 - 1e-9) / 10:.1f} percentage points"


def returns_within(returns: float, gap: float) -> str:
    """Return a bound on returns as text, rounded up; the gap is the largest share by which 1 + returns can grow."""
    most = (1.0 + returns) * (1.0 + gap) - 1.0
    return f"{math.ceil(most - 1e-9):,}" if most >= 10 else f"{math.ceil(10 * most - 1e-9) / 10:.1f}"


def named(text: str) -> str:
    """Return a text with the names of sensor types in place of their catalogue keys."""
    catalogue = load_catalogue()
    return re.sub(r"\w+", lambda word: catalogue[word[0]].name if word[0] in catalogue else word[0], text)


def date(created: str) -> str:
    """Return the date of a time (ISO 8601), such as 24 November 2026."""
    when = datetime.fromisoformat(created)
    months = ("January", "February", "March", "April", "May", "June", "July", "August", "September", "October")
    return f"{when.day} {(*months, 'November', 'December')[when.month - 1]} {when.year}"


def in_sentence(name: str) -> str:
    """Return the name of a crossing as it is within a sentence: “crossing of Rope Lane”."""
    return f"c{name[1:]}" if name.startswith("Crossing") else name


def mounting(sensor: RecordedSensor) -> str:
    """Return what a sensor is mounted on."""
    if sensor.pose is None:
        return "moved by hand: check on site"
    return f"existing pole ({sensor.position})" if sensor.on_pole else f"new post ({sensor.position})"


def plain_warning(warning: str, names: Mapping[str, str]) -> str:
    """Return a warning about a sensor type in plain words, with its name in place of its catalogue key."""
    key, _, rest = warning.partition(": ")
    if key not in names:
        return sentence(warning)
    return sentence(f"{names[key]}: {rest}")


def proof(evidence: Evidence) -> str:
    """Return what is proven of a placement among the same positions, without terms of optimisation."""
    record = evidence.record
    found = record.objective
    if found.status == MOVED:
        return MOVED_MESSAGE
    limits = limits_of(record.request.goal, "of")
    choice = f"choice{limits} among the {record.counts.positions:,} positions, under the same rules,"
    if found.bound is None:
        return f"Another {choice} may be better; how much better is not known."
    proven = "this is proven" if found.status == "optimal" else "this bound is proven"
    return f"No other {choice} {_better(evidence, found.bound)}: {proven}."


def limits_of(goal: Objective, joint: str) -> str:
    """Return the limits on a placement, its number of sensors after a word and its price, as the end of a sentence."""
    count = "" if goal.count is None else f" {joint} at most {counted(goal.count, 'sensor')}"
    return count if goal.budget is None else f"{count} for at most {dollars(goal.budget)}"


def _better(evidence: Evidence, bound: float) -> str:
    """Return what no other choice does, as the predicate of a sentence."""
    record, found = evidence.record, evidence.record.objective
    returns, optimal = record.returns, found.status == "optimal"
    if any(note.startswith(CHOSEN_FOR) for note in record.notes):
        more = possible_improvement(record) or 0.0
        if optimal:
            return "does better"
        if returns is not None and math.isclose(math.expm1(found.value), returns.typical, rel_tol=1e-3):
            return f"has more than {returns_within(returns.typical, more)} points on a typical road user"
        return f"is better by more than {math.ceil(more * 1000 - 1e-9) / 10:.1f}%"
    if found.cheapest:
        saved = f"is more than {dollars(max(0.0, found.value - bound))} cheaper"
        return "reaches the required coverage at a lower price" if optimal else saved
    more = max(0.0, bound - found.value) / math.fsum(evidence.site.problem.weights)
    what = "of the road" if found.kind == "vanilla" else "of the road, counted by its weights"
    return f"covers more {what}" if optimal else f"covers more than {points(more)} more {what}"
