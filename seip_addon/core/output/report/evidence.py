"""Input of a report: the files of a result folder."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from ...arrays import Boolean, Integer
from ...errors import SeipError
from ...geometry.geo_reference import GeoReference
from ...sensing.visibility.grid import VisibilityGrid
from ..results.file_names import POSE_ERROR_PICTURES, TRAFFIC_PICTURES
from ..results.placement_file import load_placement
from ..results.placement_record import PlacementRecord, RecordedSensor
from ..results.site_file import SiteFile, load_site_file

PICTURES = ("view.png", "plan.png")


@dataclass(frozen=True, eq=False)
class Evidence:
    """The files of a result.

    Parameters
    ----------
    grid : VisibilityGrid or None
        None where the folder does not hold the one that the placement was made on.
    pictures : mapping of str to bytes
        PNG by file name, those that are there.
    """

    record: PlacementRecord
    site: SiteFile
    grid: VisibilityGrid | None
    pictures: Mapping[str, bytes]

    @property
    def sensors(self) -> tuple[RecordedSensor, ...]:
        """The sensors, in the order of the rows of `SiteFile.seen`."""
        return self.record.sensors

    @property
    def seen_by(self) -> Integer:
        """How many sensors see each target, (t,) int64."""
        times: Integer = self.site.seen.sum(axis=0, dtype=np.int64)
        return times

    @property
    def seen(self) -> Boolean:
        """Mask of the targets that some sensor sees, (t,) bool."""
        return self.seen_by > 0

    @property
    def cell(self) -> float:
        """Square metres that a target stands for."""
        return self.site.targets.spacing**2

    @property
    def geo_reference(self) -> GeoReference:
        """Georeference of the map."""
        known = self.record.site.geo_reference
        if known is None:
            return GeoReference()
        x, y, z = known.header_offset_m
        return GeoReference(known.projection, (x, y, z, np.radians(known.header_heading_deg)))


def load_evidence(folder: Path) -> Evidence:
    """Read the files of a result.

    Raises
    ------
    SeipError
        The folder is missing, holds no placement, or holds files that are damaged or of different placements.
    """
    if not folder.is_dir():
        raise SeipError(f"there is no folder {folder}: name the one that `seip place` has written its result to")
    if not (folder / "placement.json").is_file():
        raise SeipError(f"{folder} holds no placement.json: name a folder that `seip place` has written its result to")
    record, site = load_placement(folder / "placement.json"), load_site_file(folder / "site.npz")
    key = record.inputs.get("visibility")
    if site.key != key or len(site.seen) != len(record.sensors):
        raise SeipError(f"{folder} holds files of different placements: place the sensors again")
    counts = record.counts
    if (counts.targets, counts.poses) != (len(site.targets), len(site.problem.prices)):
        raise SeipError(f"placement.json and site.npz in {folder} contradict each other: place the sensors again")
    names = [*PICTURES]
    names += POSE_ERROR_PICTURES if record.request.goal.scenarios.errs else ()
    names += TRAFFIC_PICTURES if record.request.goal.scenarios.kind == "traffic" else ()
    pictures = {name: _picture(folder / name) for name in names if (folder / name).is_file()}
    return Evidence(record, site, _grid(folder / "visibility.npz", site), pictures)


def _grid(path: Path, site: SiteFile) -> VisibilityGrid | None:
    """Return the grid that the placement was made on; None where the file is missing or another's."""
    if not path.is_file():
        return None
    grid = VisibilityGrid.load(path)
    fits = grid.key == site.key and grid.shape == (len(site.problem.prices), len(site.targets))
    return grid if fits else None


def _picture(path: Path) -> bytes:
    try:
        content = path.read_bytes()
        with Image.open(io.BytesIO(content), formats=("PNG",)) as picture:
            picture.load()
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise SeipError(f"{path} is damaged or no picture: place the sensors again") from error
    return content
