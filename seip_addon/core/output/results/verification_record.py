"""``verification.json``: an installation compared with its plan."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ...errors import SeipError
from ...sensing.recordings.figures import CoverageSteps, Gain, ReturnShare
from ...storage.files import read_small
from ...storage.json_dataclass import from_json

SCHEMA = "seip-verification/1"

_MOST_BYTES = 1 << 26

Vector = tuple[float, float, float]
Angles = tuple[float, float, float]
Row = tuple[float, ...]
Box = tuple[float, float, float, float, float, float, float]


@dataclass(frozen=True)
class RecordedBackground:
    """Sweeps that a background was learned from; see `Background`."""

    sweeps: int
    seconds: float
    uncertain: float


@dataclass(frozen=True)
class RecordedPose:
    """A sensor as it is installed.

    Parameters
    ----------
    id, sensor : str
        Its label, and its type's key in the catalogue.
    local_m, orientation
        Fitted pose: position, and rows of the rotation from the sensor's axes to the site's.
    shift_m, rotation_deg
        Fitted less planned pose; the rotation vector about the site's axes.
    shift_half_width_m, rotation_half_width_deg
        Half the width of the 95 % interval of each of their components.
    match : float, 0 to 1
        Share of the rays that agree with the scene.
    """

    id: str
    sensor: str
    local_m: Vector
    orientation: tuple[Row, Row, Row]
    shift_m: Vector
    shift_half_width_m: tuple[float, float, float]
    rotation_deg: Angles
    rotation_half_width_deg: Angles
    match: float
    background: RecordedBackground
    gain: Gain | None
    returns: tuple[ReturnShare, ...]

    @property
    def planned_m(self) -> tuple[float, ...]:
        """Planned position."""
        return tuple(at - shift for at, shift in zip(self.local_m, self.shift_m, strict=True))


@dataclass(frozen=True)
class RecordedChange:
    """An object that is new, gone, or a standing vehicle; see `Change`.

    Parameters
    ----------
    coverage_cost : float or None
        Share of the road that it costs, negative if it gains; None where it was not computed.
    """

    kind: Literal["new", "gone", "vehicle"]
    name: str
    box: Box
    rays: int
    coverage_cost: float | None


@dataclass(frozen=True)
class VerificationRecord:
    """Content of ``verification.json``.

    Parameters
    ----------
    site, recording : str
        Names of the scene and of the recording.
    """

    site: str
    recording: str
    sensors: tuple[RecordedPose, ...]
    changes: tuple[RecordedChange, ...]
    coverage: CoverageSteps


def load_verification(path: Path) -> VerificationRecord:
    """Read ``verification.json``.

    Raises
    ------
    SeipError
        It is damaged, or of a version that this program cannot read.
    """
    text = read_small(path, _MOST_BYTES, "verify the installation again")
    try:
        content = json.loads(text)
        schema = content.get("schema") if isinstance(content, dict) else None
        if schema == SCHEMA:
            return from_json(VerificationRecord, content)
    except (ValueError, RecursionError) as error:
        raise SeipError(f"{path} is damaged or not a verification: {error}; verify the installation again") from error
    raise SeipError(f"{path} has the schema {schema!r}, not {SCHEMA!r}: verify the installation again")
