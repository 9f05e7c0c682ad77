"""Input of a report: the files of a result folder."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.arrays import Integer
from ...base.errors import SeipError
from ...geometry.geo_reference import GeoReference
from ..results.file_names import (
    POSE_ERROR_PICTURES,
    TRAFFIC_PICTURE,
    VERIFICATION_FILE,
    VERIFICATION_FOLDER,
    VERIFICATION_PICTURE,
)
from ..results.placement_record import PlacementRecord, load_placement
from ..results.site_file import SiteFile, load_site_file
from ..results.verification_record import VerificationRecord, load_verification

PICTURES = ("view.png", "plan.png")
SAME_PLACE = 0.001
"""Metres by which the planned position in a verification may differ from the placement: poses in scenes are rounded."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """The files of a result.

    Parameters
    ----------
    pictures : mapping of str to bytes
        Existing pictures as PNG by file name, those of a verification included.
    verification : VerificationRecord or None
        Installation compared with the plan, if it was verified.
    """

    record: PlacementRecord
    site: SiteFile
    pictures: Mapping[str, bytes]
    verification: VerificationRecord | None = None

    @property
    def seen_by(self) -> Integer:
        """Number of sensors that see each target, (t,) int64."""
        return np.asarray(self.site.seen.sum(axis=0, dtype=np.int64))

    @property
    def area(self) -> float:
        """Square metres of road."""
        return len(self.site.targets) * self.site.targets.spacing**2

    @property
    def geo_reference(self) -> GeoReference:
        """Georeference of the map."""
        known = self.record.site.geo_reference
        return GeoReference() if known is None else known.geo_reference


def load_evidence(folder: Path) -> Evidence:
    """Read the files of a result.

    Raises
    ------
    SeipError
        The folder is missing, holds no placement, or holds files that are damaged or of different placements.
    """
    if not (folder / "placement.json").is_file():
        raise SeipError(f"{folder} holds no placement.json: name a folder that `seip place` has written its result to")
    record, site = load_placement(folder / "placement.json"), load_site_file(folder / "site.npz")
    key = record.inputs.get("visibility")
    if site.key != key or len(site.seen) != len(record.sensors):
        raise SeipError(f"{folder} holds files of different placements: place the sensors again")
    names = list(PICTURES)
    names += POSE_ERROR_PICTURES if record.request.goal.scenarios.errs else ()
    names += [TRAFFIC_PICTURE] if record.request.goal.scenarios.kind == "traffic" else []
    pictures = {name: (folder / name).read_bytes() for name in names if (folder / name).is_file()}
    verification = _verification(folder / VERIFICATION_FOLDER, record)
    path = folder / VERIFICATION_FOLDER / VERIFICATION_PICTURE
    if verification is not None and path.is_file():
        pictures[path.name] = path.read_bytes()
    return Evidence(record, site, pictures, verification)


def _verification(folder: Path, record: PlacementRecord) -> VerificationRecord | None:
    """Return the verification of a placement, None without one."""
    path = folder / VERIFICATION_FILE
    if not path.is_file():
        return None
    found, planned = load_verification(path), {sensor.id: sensor for sensor in record.sensors}
    for one in found.sensors:
        plan = planned.get(one.id)
        if plan is None or plan.sensor != one.sensor or math.dist(plan.local_m, one.planned_m) > SAME_PLACE:
            raise SeipError(f"{path} is of another placement: verify the installation again, or move {folder} away")
    return found
