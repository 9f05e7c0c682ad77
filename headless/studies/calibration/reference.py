"""Measurements of LiDAR sweeps: shares returned, beams, range noise, and correlation of the fates of rays."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.errors import SeipError
from seip_addon.core.storage.json_dataclass import from_json

_BIN = re.compile(r"(\d{1,4})-(\d{1,4})|>(\d{1,4})")


@dataclass(frozen=True)
class RangeBin:
    """An interval of ranges.

    Parameters
    ----------
    bin : str
        Ends in metres, such as ``20-30``, or ``>100``.
    """

    bin: str

    def __post_init__(self) -> None:
        if not (_BIN.fullmatch(self.bin) and self.low < self.high):
            raise ValueError(f"bin must be two ascending ranges in metres such as '20-30', or '>100', not {self.bin!r}")

    @property
    def low(self) -> float:
        """Least range in metres."""
        return float(self.bin.lstrip(">").partition("-")[0])

    @property
    def high(self) -> float:
        """Greatest range in metres; infinite for an open bin."""
        return float(self.bin.partition("-")[2] or math.inf)

    @property
    def middle(self) -> float:
        """Middle of the bin in metres; infinite for an open bin."""
        return (self.low + self.high) / 2.0


@dataclass(frozen=True)
class ShareBin(RangeBin):
    """Share of the rays that return from surfaces in a range bin.

    Parameters
    ----------
    rays : int
        Number of rays that hit a surface, returned or not.
    share : float
        Share that returned, 0 to 1.
    mean_cos_incidence : float
        Mean cosine of the angle of incidence, 0 to 1.
    sector_bootstrap95 : tuple of two floats
        Interval of the share, ascending.
    """

    rays: int
    share: float
    mean_cos_incidence: float
    sector_bootstrap95: tuple[float, float]

    def __post_init__(self) -> None:
        super().__post_init__()
        low, high = self.sector_bootstrap95
        for name, value in (("share", self.share), ("mean_cos_incidence", self.mean_cos_incidence)):
            _require_share(f"bin {self.bin}: {name}", value)
        if not 0 <= low <= high <= 1:
            raise ValueError(f"bin {self.bin}: sector_bootstrap95 must be two ascending shares, not {[low, high]}")
        if self.rays < 1:
            raise ValueError(f"bin {self.bin}: rays must be 1 or more, not {self.rays}")


@dataclass(frozen=True)
class NoiseBin(RangeBin):
    """The robust standard deviation of ranges in a bin, in metres."""

    robust_std_m: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.robust_std_m < 100:
            raise ValueError(f"bin {self.bin}: robust_std_m must lie between 0 and 100 m, not {self.robust_std_m}")


@dataclass(frozen=True)
class SweepsBin(RangeBin):
    """The intraclass correlation of one ray's fate over sweeps."""

    intraclass_correlation: float

    def __post_init__(self) -> None:
        super().__post_init__()
        _require_correlation(f"bin {self.bin}: intraclass_correlation", self.intraclass_correlation)


@dataclass(frozen=True)
class Beams:
    """Beams of a sensor, in degrees; azimuth offsets are positive along or against the rotation of its head."""

    elevation_deg: tuple[float, ...]
    azimuth_offset_deg: tuple[float, ...]
    azimuth_step_deg: float

    def __post_init__(self) -> None:
        checks = {
            "elevation_deg must hold 1 to 1,000 beams": 1 <= len(self.elevation_deg) <= 1000,
            "elevation_deg must lie between -90 and 90": all(abs(value) < 90 for value in self.elevation_deg),
            "azimuth_offset_deg must have one number for each of elevation_deg": (
                len(self.azimuth_offset_deg) == len(self.elevation_deg)
            ),
            "azimuth_offset_deg must lie between -360 and 360": all(abs(one) <= 360 for one in self.azimuth_offset_deg),
            "azimuth_step_deg must lie between 0.01 and 10": 0.01 <= self.azimuth_step_deg <= 10,
            "a revolution must have at most 1,000,000 rays": len(self.elevation_deg) * 360
            <= 1e6 * self.azimuth_step_deg,
        }
        for requirement, holds in checks.items():
            if not holds:
                raise ValueError(f"beams: {requirement}")


@dataclass(frozen=True)
class Identity:
    """Name of a sensor, and its height above the road in metres."""

    sensor: str
    mounting_height_m: float

    def __post_init__(self) -> None:
        if not 0.1 <= self.mounting_height_m <= 100:
            raise ValueError(f"mounting_height_m must lie between 0.1 and 100 m, not {self.mounting_height_m}")


@dataclass(frozen=True)
class MeasuredSensor:
    """Figures of a sensor's sweeps; fields have the names of the file's keys."""

    identity: Identity
    ground_by_range_m: tuple[ShareBin, ...]
    vertical_by_range_m: tuple[ShareBin, ...]
    range_noise_ground: tuple[NoiseBin, ...]
    range_noise_vertical: tuple[NoiseBin, ...]
    fate_correlation_along_ring_20_to_100_m: Mapping[str, float]
    beams: Beams
    ground_by_range_m_over_20_sweeps: tuple[SweepsBin, ...] = ()

    def __post_init__(self) -> None:
        if not self.ground_by_range_m or not self.vertical_by_range_m:
            raise ValueError("ground_by_range_m and vertical_by_range_m must have at least one bin each")
        for lag, value in self.fate_correlation_along_ring_20_to_100_m.items():
            where = "fate_correlation_along_ring_20_to_100_m"
            if not (lag.isdecimal() and lag.isascii() and 1 <= int(lag[:4]) <= 100 and len(lag) <= 3):
                raise ValueError(f"{where}: keys must be distances in rays, 1 to 100, not {lag[:20]!r}")
            _require_correlation(f"{where}.{lag}", value)

    @property
    def height(self) -> float:
        """Height above the road in metres."""
        return self.identity.mounting_height_m

    @property
    def elevations(self) -> Float:
        """Elevations (c,) in radians."""
        return np.radians(self.beams.elevation_deg)

    @property
    def fate_correlation(self) -> dict[int, float]:
        """Correlation of the fates of rays by their distance along the ring, in rays."""
        return {int(lag): value for lag, value in self.fate_correlation_along_ring_20_to_100_m.items()}


@dataclass(frozen=True)
class Reference:
    """A file of measurements."""

    version: Literal[1]
    sensors: Mapping[str, object]


def load_reference(path: str | os.PathLike[str]) -> dict[str, MeasuredSensor]:
    """Read the measured sensors of a file by name; docs/formats.md describes the file.

    Raises
    ------
    SeipError
        The file cannot be read, or something in it is missing or out of its range.
    """
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise SeipError(f"cannot read the measurements {path} ({error}): name a JSON file") from error
    where = str(path)
    try:
        sensors = from_json(Reference, content).sensors
        measured = {}
        for name, figures in sensors.items():
            where = f"{path}, sensor {name!r}"
            measured[name] = from_json(MeasuredSensor, figures)
    except ValueError as error:
        raise SeipError(f"{where}: {error}; docs/formats.md describes the file") from error
    if not measured:
        raise SeipError(f"{path}: sensors is empty; docs/formats.md describes the file")
    return measured


def _require_share(name: str, value: float) -> None:
    if not 0 <= value <= 1:
        raise ValueError(f"{name} must lie between 0 and 1, not {value}")


def _require_correlation(name: str, value: float) -> None:
    if not -1 <= value <= 1:
        raise ValueError(f"{name} must lie between -1 and 1, not {value}")
