"""``verification.json``: an installation compared with its plan."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ...sensing.recordings.figures import CoverageSteps
from ...sensing.recordings.verification import InstalledSensor
from ...storage.files import read_small
from ...storage.json_dataclass import read_record

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
    cure = "verify the installation again"
    return read_record(VerificationRecord, read_small(path, _MOST_BYTES, cure), SCHEMA, str(path), cure)
