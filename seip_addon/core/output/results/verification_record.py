"""``verification.json``: an installation compared with its plan."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Literal

from ...sensing.recordings.verification import CoverageSteps, InstalledSensor
from ...site.locations import direction
from ...storage.files import read_small
from ...storage.json_dataclass import read_record

SCHEMA = "seip-verification/1"

_MOST_BYTES = 1 << 26

Box = tuple[float, float, float, float, float, float, float]
LEAST_COST = 0.0005
"""Share of coverage that is shown as 0.1 points."""
_LEAST_SHIFT, _LEAST_ANGLE = 0.005, 0.05  # metres and degrees that are shown as 0.01 m and 0.1 degrees


@dataclass(frozen=True)
class RecordedChange:
    """An object that is new, gone, or a standing vehicle; see `Change`.

    ``coverage_cost`` is the share of the road that it costs, negative if it gains; None if it was not computed.
    """

    kind: Literal["new", "gone", "vehicle"]
    name: str
    box: Box
    rays: int
    coverage_cost: float | None


@dataclass(frozen=True)
class VerificationRecord:
    """Content of ``verification.json``, with the names of the scene and of the recording."""

    site: str
    recording: str
    sensors: tuple[InstalledSensor, ...]
    changes: tuple[RecordedChange, ...]
    coverage: CoverageSteps


def load_verification(path: Path) -> VerificationRecord:
    """Read ``verification.json``.

    Raises
    ------
    SeipError
        It is damaged, or of a version that this program cannot read.
    """
    cure = "verify the installation again"
    return read_record(VerificationRecord, read_small(path, _MOST_BYTES, cure), (SCHEMA,), str(path), cure)


def pose_text(pose: InstalledSensor) -> str:
    """Return two sentences: how far a sensor is from its plan, in position and in direction, with intervals."""
    east, north, up = pose.shift_m
    parts = [
        f"{abs(value):.2f} m {positive if value > 0 else negative}"
        for value, positive, negative in ((east, "east", "west"), (north, "north", "south"), (up, "higher", "lower"))
        if abs(value) >= _LEAST_SHIFT
    ]
    at = f"{pose.id} is {math.hypot(*pose.shift_m):.2f} m from its planned position"
    where = f"{at}: {_listed(parts)}" if parts else at
    known = f"each within {max(1, math.ceil(1000 * max(pose.shift_half_width_m) - 1e-9)):,} mm with 95% confidence"
    lean_x, lean_y, turn = pose.rotation_deg
    lean, parts = math.hypot(lean_x, lean_y), []
    if abs(turn) >= _LEAST_ANGLE:
        parts.append(f"turned {abs(turn):.1f}° {'counter-clockwise' if turn > 0 else 'clockwise'} as seen from above")
    if lean >= _LEAST_ANGLE:
        # A rotation vector (x, y) about horizontal axes moves the top of the sensor along (y, -x).
        parts.append(f"tilted {lean:.1f}° to the {direction((lean_y, -lean_x))}")
    within = max(1, math.ceil(100 * max(pose.rotation_half_width_deg) - 1e-9)) / 100
    points = f"It is {_listed(parts)}" if parts else "It points as planned"
    return f"{where}, {known}. {points}, within {within:.2f}°."


def gain_text(pose: InstalledSensor) -> str:
    """Return what the gain of a unit means for its range."""
    if pose.gain is None:
        return f"The recording does not determine the gain of {pose.id}; it counts as its data sheet says."
    gain = pose.gain
    # Received power falls with the square of the distance, so that the range grows with the root of the gain.
    reach, low, high = (math.sqrt(value) for value in (gain.value, gain.low, gain.high))
    says = f"{pose.id} has a gain of {gain.value:.2f} ({gain.low:.2f} to {gain.high:.2f})"
    if gain.low <= 1.0 <= gain.high:
        return f"{says}, which does not differ significantly from its model: its range is as promised."
    return f"{says}: it detects the same surface up to about {reach:.0%} of the distance ({low:.0%} to {high:.0%})."


def change_text(change: RecordedChange) -> str:
    """Return what a change is."""
    return {"new": "not in the plan", "gone": "no longer there", "vehicle": "standing vehicle"}[change.kind]


def cost_text(cost: float | None) -> str:
    """Return what a change costs of the coverage."""
    if cost is None:
        return "not computed"
    if abs(cost) < LEAST_COST:
        return "no effect"
    return f"{'costs' if cost > 0 else 'adds'} {abs(100 * cost):.1f} points"


def objects(record: VerificationRecord) -> list[RecordedChange]:
    """Return the changes that are not vehicles."""
    return [change for change in record.changes if change.kind != "vehicle"]


def vehicles(record: VerificationRecord) -> int:
    """Return the number of vehicles that stood still during the recording."""
    return sum(change.kind == "vehicle" for change in record.changes)


def coverage_text(steps: CoverageSteps) -> str:
    """Return promised and installed coverage, and what makes the difference, one effect after the other."""
    names = ("poses of the sensors", "changed objects", "gain")
    shares = pairwise((steps.promised, steps.pose, steps.obstacles, steps.installed))
    effects = [round(100 * (after - before), 1) for before, after in shares]
    signs = ["−" if effect < 0 else "+" if effect > 0 else "" for effect in effects]
    parts = [f"{name} {sign}{abs(effect):.1f}" for name, sign, effect in zip(names, signs, effects, strict=True)]
    return (
        f"The installation sees {steps.installed:.1%} of the road; {steps.promised:.1%} were promised. "
        f"In percentage points: {', '.join(parts)}."
    )


def _listed(parts: Sequence[str]) -> str:
    return " and ".join([", ".join(parts[:-1]), parts[-1]]) if len(parts) > 1 else parts[0]
