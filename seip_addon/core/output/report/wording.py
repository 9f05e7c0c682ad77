"""Sentences of a report: what was proven, warnings in plain words, positions and dates."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from datetime import datetime

from ...choosing.placement.objective import CHOSEN_FOR, MOVED, MOVED_MESSAGE, Objective, certificate
from ...counts import counted
from ..results.answer import sentence
from ..results.placement_record import RecordedObjective, RecordedSensor
from .evidence import Evidence

_RINGS = re.compile(r"beyond (.*?) neighbouring rings on a level road are more than 2δ = ([\d.]+) m apart.*")
_RANGE = re.compile(r"detects this road \((.*?) reflectivity\) with (.*?) probability up to (.*?)(?:;.*)?$")


def dollars(amount: float) -> str:
    """Return an amount in whole dollars."""
    return f"${amount:,.0f}"


def points(share: float) -> str:
    """Return a share as percentage points, rounded up."""
    return f"{math.ceil(share * 1000 - 1e-9) / 10:.1f} percentage points"


def date(created: str) -> str:
    """Return the date of a time (ISO 8601), such as 24 November 2026."""
    when = datetime.fromisoformat(created)
    months = ("January", "February", "March", "April", "May", "June", "July", "August", "September", "October")
    return f"{when.day} {(*months, 'November', 'December')[when.month - 1]} {when.year}"


def geographic(latitude: float, longitude: float, digits: int) -> str:
    """Return latitude and longitude in degrees with their hemispheres."""
    north, east = "N" if latitude >= 0 else "S", "E" if longitude >= 0 else "W"
    return f"{abs(latitude):.{digits}f}° {north}, {abs(longitude):.{digits}f}° {east}"


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
    rings, detects = _RINGS.fullmatch(rest), _RANGE.fullmatch(rest)
    if rings is not None:
        return (
            f"{names[key]}: beyond {rings[1]} the beams meet the road more than {rings[2]} m apart. Parts of the road "
            "there are not seen although nothing blocks the view."
        )
    if detects is not None:
        return (
            f"{names[key]}: a road surface that reflects {detects[1]} of the light is detected with {detects[2]} "
            f"probability up to {detects[3]}; vehicles are detected much farther."
        )
    return sentence(f"{names[key]}: {rest}")


def certificate_sentence(evidence: Evidence) -> str:
    """Return the sentence on the proven optimality gap among the same positions."""
    record = evidence.record
    found, places = record.objective, record.counts.positions
    if found.status == MOVED:
        return MOVED_MESSAGE
    if any(note.startswith(CHOSEN_FOR) for note in record.notes):
        return certificate(found.status, found.gap, cheapest=found.cheapest, notes=record.notes)
    choice = f"choice{limits_of(record.request.goal, 'of')} among the {places:,} positions, under the same rules,"
    if found.bound is None:
        return f"Another {choice} may be better; how much better is not known."
    better = _cheaper(found) if found.cheapest else _more_coverage(evidence)
    proven = "this is proven" if found.status == "optimal" else "this bound is proven"
    return f"No other {choice} {better}: {proven}."


def proof(evidence: Evidence) -> str:
    """Return what is proven of a placement, without terms of optimisation."""
    record = evidence.record
    found = record.objective
    if found.status == MOVED or not any(note.startswith(CHOSEN_FOR) for note in record.notes):
        return certificate_sentence(evidence)
    choice = f"choice{limits_of(record.request.goal, 'of')} among the {record.counts.positions:,} possible positions"
    if found.status == "optimal":
        return f"No other {choice} does better: this is proven."
    better = "how much better is not known" if found.gap is None else f"by at most {found.gap:.1%}: this is proven"
    return f"Another {choice} may do better, {better}."


def limits_of(goal: Objective, joint: str) -> str:
    """Return the limits on a placement, its number of sensors after a word and its price, as the end of a sentence."""
    count = "" if goal.count is None else f" {joint} at most {counted(goal.count, 'sensor')}"
    return count if goal.budget is None else f"{count} for at most {dollars(goal.budget)}"


def _cheaper(found: RecordedObjective) -> str:
    if found.status == "optimal" or found.bound is None:
        return "reaches the required coverage at a lower price"
    return f"is more than {dollars(max(0.0, found.value - found.bound))} cheaper"


def _more_coverage(evidence: Evidence) -> str:
    found = evidence.record.objective
    what = "of the road" if found.kind == "vanilla" else "of the road, counted by its weights"
    if found.status == "optimal" or found.bound is None:
        return f"covers more {what}"
    more = max(0.0, found.bound - found.value) / math.fsum(evidence.site.problem.weights)
    return f"covers more than {points(more)} more {what}"
