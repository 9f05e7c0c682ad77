"""``verification.json``: an installation compared with its plan."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ...errors import SeipError
from ...sensing.recordings.figures import CoverageSteps
from ...sensing.recordings.verification import InstalledSensor
from ...storage.files import read_small
from ...storage.json_dataclass import from_json

SCHEMA = "seip-verification/1"

_MOST_BYTES = 1 << 26

Box = tuple[float, float, float, float, float, float, float]


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
    text = read_small(path, _MOST_BYTES, "verify the installation again")
    try:
        content = json.loads(text)
        schema = content.get("schema") if isinstance(content, dict) else None
        if schema == SCHEMA:
            return from_json(VerificationRecord, content)
    except (ValueError, RecursionError) as error:
        raise SeipError(f"{path} is damaged or not a verification: {error}; verify the installation again") from error
    raise SeipError(f"{path} has the schema {schema!r}, not {SCHEMA!r}: verify the installation again")
