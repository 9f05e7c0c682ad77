"""``detection.json``: what a detector finds with the sensors of a placement."""

from collections.abc import Mapping
from dataclasses import dataclass

from ...storage.json_dataclass import read_record

SCHEMA = "seip-detection/1"
RECORDING_SCHEMA = "seip-recording/2"
"""Schema of a ``detection.json`` on the recording of real sensors."""
MAIN_RULE = "bev_0.7"
"""Counts all road users; in every record."""
FORMATS = ("kitti", "openpcdet")
"""Folders of the detections of each frame, beside ``detection.json``."""


@dataclass(frozen=True)
class Precision:
    """Average precision by one rule, 0 to 1, with the number of road users that count over all frames.

    It is NaN without road users; records leave such rules out. ``interval`` is that of 95 % over runs of traffic, None
    if these are too few.
    """

    average_precision: float
    interval: tuple[float, float] | None
    road_users: int


@dataclass(frozen=True)
class DetectionRecord:
    """Part of a ``detection.json`` that is shown: average precision by rule, and warnings."""

    average_precision: Mapping[str, Precision]
    warnings: tuple[str, ...]

    def __post_init__(self) -> None:
        if MAIN_RULE not in self.average_precision:
            raise ValueError(f"average_precision.{MAIN_RULE} is missing")


def parsed_detection(text: str) -> DetectionRecord:
    """Read the text of a ``detection.json``; raise `SeipError` if it is none, or one of another version."""
    return read_record(DetectionRecord, text, (SCHEMA,), "the record of detection", "detect again")
