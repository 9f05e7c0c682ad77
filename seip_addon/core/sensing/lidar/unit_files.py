"""Calibration files of single units: the beams of one sensor as measured by its maker.

The formats are Ouster's metadata (JSON, flat and nested), Velodyne's calibration (XML and the YAML of its ROS driver)
and the angle corrections of Hesai and RoboSense (CSV). Azimuths of Ouster, Hesai and RoboSense are clockwise as seen
from above, and Velodyne's corrections are subtracted from a clockwise azimuth. Offsets here are counter-clockwise.
"""

from __future__ import annotations

import csv
import itertools
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from defusedxml import DefusedXmlException
from defusedxml.ElementTree import ParseError, fromstring

from ...arrays import Float
from ...errors import SeipError
from ...limits import BEAM_ELEVATION, DEGREES, UNIT_BEAMS
from .model import LidarModel

MAX_BYTES = 4_000_000
"""Largest size of a file; those of makers have 60 kB."""

_LEAST_APART = 1e-6  # least difference in degrees between two different beams


@dataclass(frozen=True, eq=False)
class UnitBeams:
    """Beams of a unit.

    Parameters
    ----------
    elevations, azimuth_offsets : (c,) float64, degrees
        Angles of each beam; azimuth offsets are counter-clockwise.
    product : str
        Product name in the file, or "".
    columns : int, optional
        Azimuth steps in a revolution.
    rotation_rate : float, hertz, optional
        Revolutions per second.
    """

    elevations: Float
    azimuth_offsets: Float
    product: str = ""
    columns: int | None = None
    rotation_rate: float | None = None

    def __post_init__(self) -> None:
        count = len(self.elevations)
        if not UNIT_BEAMS.allow(count) or self.azimuth_offsets.shape != (count,):
            raise ValueError(
                f"holds {count} elevations and {len(self.azimuth_offsets)} azimuth offsets, not {UNIT_BEAMS}"
            )
        for what, values, limits in (
            ("elevation", self.elevations, BEAM_ELEVATION),
            ("azimuth offset", self.azimuth_offsets, DEGREES),
        ):
            if fault := limits.fault(values):
                raise ValueError(f"has an {what} that {fault}")
        beams = np.stack([self.elevations, self.azimuth_offsets], axis=1)
        order = np.lexsort(beams.T)
        same = np.flatnonzero((np.abs(np.diff(beams[order], axis=0)) < _LEAST_APART).all(axis=1))
        if len(same):
            first, second = sorted(int(order[same[0] + step]) + 1 for step in (0, 1))
            raise ValueError(f"has the same angles for its beams {first} and {second}")

    @property
    def key(self) -> str:
        """Catalogue key for the product's name, such as os1_128 for OS-1-128, or ""."""
        known = re.match(r"OS-?(\d)-(\d{1,3})(?:-|$)", self.product)
        return f"os{known[1]}_{known[2]}" if known else ""

    def as_model(self, base: LidarModel, source: str) -> LidarModel:
        """Return a model with these beams, and with columns and rate if these are known.

        Raises
        ------
        SeipError
            The model draws a rosette or has a different number of channels, or columns or rate are out of range.
        """
        if base.rosette is not None:
            raise SeipError(
                f"{source} has the beams of channels, but LiDAR '{base.key}' draws a rosette: name another one"
            )
        if len(self.elevations) != base.channels:
            raise SeipError(
                f"{source} has {len(self.elevations)} beams, but LiDAR '{base.key}' has {base.channels}: name another "
                f"one, as in KEY={source}"
            )
        rate = base.rotation_rate if self.rotation_rate is None else self.rotation_rate
        steps = base.azimuth_count if self.columns is None else self.columns
        points = base.points_per_second if self.columns is None else steps * rate * base.channels
        return replace(
            base,
            source=f"{base.source}; beams of {source}",
            assumed_beams="",
            elevations=np.radians(self.elevations),
            azimuth_offsets=np.radians((self.azimuth_offsets + 180.0) % 360.0 - 180.0),
            rotation_rate=rate,
            points_per_second=points,
        )


def is_unit_file(path: Path) -> bool:
    """Return whether a file is a calibration file of a unit, by its suffix."""
    return path.suffix.lower() in _READERS


def read_unit_file(path: Path) -> UnitBeams:
    """Read the beams of a unit.

    Raises
    ------
    SeipError
        The file cannot be read, is too large, or has an unknown format.
    """
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
        text = content.decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise SeipError(f"cannot read the calibration {path}: {error}") from error
    if len(content) > MAX_BYTES:
        raise SeipError(f"{path} has over {MAX_BYTES / 1e6:g} MB: it is not a calibration of a LiDAR")
    try:
        return _READERS[path.suffix.lower()](text)
    except DefusedXmlException as error:
        raise SeipError(f"{path} declares entities, which a calibration may not: remove them") from error
    except (ParseError, csv.Error, RecursionError) as error:
        raise SeipError(f"{path} is broken: {error}") from error
    except ValueError as error:
        raise SeipError(f"{path} {error}") from error


def _ouster(text: str) -> UnitBeams:
    try:
        content = _object(json.loads(text), "content")
    except json.JSONDecodeError as error:
        raise ValueError(f"is not valid JSON: {error}") from error
    nested = "beam_intrinsics" in content
    if nested and "beam_altitude_angles" in content:
        raise ValueError("has beam_altitude_angles both at the top and in beam_intrinsics")
    beams = _object(content["beam_intrinsics"], "beam_intrinsics") if nested else content
    lidar = _object(content.get("config_params", {}), "config_params") if nested else content
    sensor = _object(content.get("sensor_info", {}), "sensor_info") if nested else content
    layout = content.get("lidar_data_format" if nested else "data_format")
    elevations = _angles(beams, "beam_altitude_angles")
    offsets = _angles(beams, "beam_azimuth_angles")
    rows = layout.get("pixels_per_column") if isinstance(layout, dict) else None  # old firmware has a text there
    if rows not in (None, len(elevations)):  # whatever JSON holds there
        raise ValueError(f"has {len(elevations)} beam_altitude_angles for {rows!r} pixels_per_column")
    mode = str(lidar.get("lidar_mode", ""))
    known = re.fullmatch(r"(\d{3,5})x(\d{1,3})", mode)
    if mode and not known:
        raise ValueError(f"has the lidar_mode {mode[:20]!r}, which is not like 1024x10")
    return UnitBeams(
        elevations,
        -offsets,
        str(sensor.get("prod_line", "")),
        int(known[1]) if known else None,
        float(known[2]) if known else None,
    )


def _object(value: object, name: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError(f"has a {name} that is not an object")  # noqa: TRY004 -- of the file, not of a caller
    return value


def _angles(content: Mapping[str, Any], name: str) -> Float:
    values = content.get(name)
    if not isinstance(values, list) or not all(type(value) in {int, float} for value in values):
        raise ValueError(f"has no list of numbers {name}")
    return np.array([_number(value, name) for value in values])


def _velodyne_xml(text: str) -> UnitBeams:
    document = fromstring(text)
    enabled = [(item.text or "").strip() != "0" for item in document.findall("./DB/enabled_/item")]
    beams = {}
    for laser in document.findall("./DB/points_/item/px"):
        number = _whole(laser.findtext("id_"), "id_")
        if number in beams:
            raise ValueError(f"has two lasers of id_ {number}")
        beams[number] = [_number(laser.findtext(name), name) for name in ("vertCorrection_", "rotCorrection_")]
    on = {number for number in beams if not enabled or (number < len(enabled) and enabled[number])}
    return _by_number({number: beams[number] for number in on})


def _velodyne_yaml(text: str) -> UnitBeams:
    beams = {}
    for laser in _yaml_lasers(text):
        number = _whole(laser.get("laser_id"), "laser_id")
        if number in beams:
            raise ValueError(f"has two lasers of laser_id {number}")
        beams[number] = [math.degrees(_number(laser.get(name), name)) for name in ("vert_correction", "rot_correction")]
    return _by_number(beams)


def _yaml_lasers(text: str) -> Iterator[dict[str, str]]:
    """Yield the maps below ``lasers``; only the subset of YAML that these files use is supported.

    The maps are the items of a list, written between braces or with one line for each key.
    """
    lines = [bare for line in text.splitlines() if (bare := re.sub(r"(^|\s)#.*", "", line).rstrip())]
    if "lasers:" not in lines:
        raise ValueError("has no line 'lasers:'")
    stated = re.search(r"^num_lasers:\s*(\S+)\s*$", text, re.MULTILINE)
    below = itertools.takewhile(lambda line: line[0] in " -", lines[lines.index("lasers:") + 1 :])
    items: list[list[str]] = []
    for line in below:
        if line.lstrip().startswith("- "):
            items.append([line.lstrip()[2:].strip()])
        elif items:
            items[-1].append(line.strip())
        else:
            raise ValueError(f"has {line.strip()[:40]!r} before the first of its lasers")
    if stated and stated[1] != str(len(items)):
        raise ValueError(f"has {len(items)} lasers where num_lasers is {stated[1][:20]}")
    for item in items:
        whole = " ".join(item)
        parts = whole[1:-1].split(",") if whole.startswith("{") and whole.endswith("}") else item
        pairs = [re.fullmatch(r"\s*(\w+)\s*:\s*([\w.+-]+)\s*", part) for part in parts]
        if not all(pairs):
            raise ValueError(f"has lasers that are no plain maps of numbers: {whole[:40]!r}")
        yield {pair[1]: pair[2] for pair in pairs if pair}


def _angle_table(text: str) -> UnitBeams:
    """Read Hesai's table, which has a header, or that of RoboSense, which has none."""
    rows = [[field.strip() for field in row] for row in csv.reader(text.splitlines())]
    rows = [row for row in rows if any(row)]
    if not rows:
        raise ValueError("is empty")
    header = [name.lower() for name in rows[0]]
    if "elevation" in header:
        beams = dict(_numbered(rows[1:], header.index("elevation"), _column(header, "azimuth")))
        if len(beams) < sum(1 for row in rows[1:] if any(row[1:])):
            raise ValueError("has a channel twice")
    else:
        beams = dict(enumerate(_plain(rows)))
    return _by_number({number: [elevation, -azimuth] for number, (elevation, azimuth) in beams.items()})


def _column(header: Sequence[str], name: str) -> int:
    if name not in header:
        raise ValueError(f"has no column {name}")
    return header.index(name)


def _numbered(rows: Iterable[Sequence[str]], elevation: int, azimuth: int) -> Iterator[tuple[int, list[float]]]:
    for row in rows:
        if not any(row[1:]):  # some files end with a digest
            continue
        if len(row) <= max(elevation, azimuth):
            raise ValueError(f"has a row of {len(row)} fields: {','.join(row)[:40]!r}")
        yield _whole(row[0], "channel"), [_number(row[elevation], "elevation"), _number(row[azimuth], "azimuth")]


def _plain(rows: Iterable[Sequence[str]]) -> Iterator[list[float]]:
    for row in rows:
        if len(row) not in {2, 3}:
            raise ValueError(f"has a row that is not elevation, azimuth and, maybe, ring: {','.join(row)[:40]!r}")
        if len(row) == 3:
            _whole(row[2], "ring")
        yield [_number(row[0], "elevation"), _number(row[1], "azimuth")]


def _by_number(beams: Mapping[int, Sequence[float]]) -> UnitBeams:
    """Return beams in the order of their numbers: elevation and counter-clockwise offset of each, in degrees."""
    table = np.array([beams[number] for number in sorted(beams)]).reshape(-1, 2)
    return UnitBeams(table[:, 0], table[:, 1])


def _number(value: object, name: str) -> float:
    try:
        number = float(str(value))
    except ValueError:
        number = math.nan
    if not abs(number) <= 1e6:
        raise ValueError(f"has {str(value)[:20]!r} for {name}, which is not a sensible number")
    return number


def _whole(value: object, name: str) -> int:
    number = _number(value, name)
    if number != int(number) or number < 0:
        raise ValueError(f"has {str(value)[:20]!r} for {name}, which is not a whole number of at least 0")
    return int(number)


_READERS = {
    ".json": _ouster,
    ".xml": _velodyne_xml,
    ".yaml": _velodyne_yaml,
    ".yml": _velodyne_yaml,
    ".csv": _angle_table,
}
