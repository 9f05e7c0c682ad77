"""``placement.geojson``: a placement for geographic information systems, as RFC 7946 has it."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import shapely

from ...choosing.placement.deployment import Sensor
from ...storage.files import whole_file
from .headings import degrees, tilt_degrees
from .located import Located, rings

Feature = dict[str, Any]
MOST_CELLS = 100_000
"""Targets up to which each has a cell of its own, in some 30 MB; beyond, those that the same sensors see are joined."""


def save_geojson(path: str | os.PathLike[str], placed: Located) -> None:
    """Write a feature collection, a line for each feature.

    Positions are longitude and latitude, degrees on WGS 84; those of sensors have the height above the map's zero,
    metres, as their third number.
    """
    about: dict[str, object] = {"type": "FeatureCollection", "name": placed.site.name}
    if placed.site.attribution:
        about["attribution"] = placed.site.attribution
    save_features(path, about, _features(placed))


def save_features(path: str | os.PathLike[str], about: dict[str, object], features: Iterable[Feature]) -> None:
    """Write the members of a feature collection, and its features on a line each."""
    head = json.dumps(about, ensure_ascii=False)[:-1]
    lines = (json.dumps(one, ensure_ascii=False, allow_nan=False, separators=(",", ":")) for one in features)
    with whole_file(path) as temporary:
        temporary.write_text(f'{head}, "features": [\n' + ",\n".join(lines) + "\n]}\n", encoding="utf-8")


def _features(placed: Located) -> Iterator[Feature]:
    for sensor, point in zip(placed.sensors, placed.points.tolist(), strict=True):
        yield feature("sensor", {"type": "Point", "coordinates": point}, **_described(sensor))
    yield feature("region of interest", _multipolygon(placed.region), name=placed.site.name)
    for area, polygons in placed.weighted:
        yield feature("weighted region", _multipolygon(polygons), name=area.name, weight=area.weight)
    if len(placed.site.targets) > MOST_CELLS:
        for seers, polygons in placed.patches():
            patch = _multipolygon(polygons)
            yield feature("coverage patch", patch, seen_by=seers, times_seen=len(seers))
        return
    for target, square in enumerate(placed.squares().tolist()):
        cell = {"type": "Polygon", "coordinates": [[*square, square[0]]]}
        seers = placed.seers(target)
        yield feature("coverage cell", cell, target=target, seen_by=seers, times_seen=len(seers))


def _described(sensor: Sensor) -> dict[str, Any]:
    return {
        "id": sensor.label,
        "sensor": sensor.model.key,
        "sensor_name": sensor.model.name,
        "position": sensor.position_name,
        "on_pole": sensor.on_pole,
        "height_m": round(sensor.height, 3),
        "yaw_deg": degrees(sensor.yaw),
        "tilt_deg": tilt_degrees(sensor.tilt),
        "price_usd": round(sensor.price, 2),
        "coverage_alone": round(sensor.alone, 6),
    }


def feature(kind: str, geometry: dict[str, Any], **properties: object) -> Feature:
    """Return a feature with its kind among its properties."""
    return {"type": "Feature", "geometry": geometry, "properties": {"kind": kind, **properties}}


def _multipolygon(polygons: Sequence[shapely.Polygon]) -> dict[str, Any]:
    if len(polygons) == 1:
        return {"type": "Polygon", "coordinates": rings(polygons[0])}
    return {"type": "MultiPolygon", "coordinates": [rings(polygon) for polygon in polygons]}
