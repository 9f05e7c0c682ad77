"""A placement in longitude and latitude: what ``placement.geojson`` and ``placement.kml`` both show."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...arrays import Boolean, Float
from ...choosing.placement.deployment import Deployment, Sensor
from ...geometry.plan import closed
from ...site.scene_geometry import NamedArea, SceneGeometry
from ...site.site import Site
from ...site.target_squares import target_squares

LOCATED_FILES = ("placement.geojson", "placement.kml")
DECIMALS = 8  # of degrees: about a millimetre
GAP = 0.06
"""Cracks in the region up to twice this (metres) are closed."""
METRE_DECIMALS = 6  # to which the corners of squares are rounded, so that neighbours share theirs


@dataclass(frozen=True, eq=False)
class Located:
    """A placement on WGS 84.

    Parameters
    ----------
    points : (k, 3) float64
        Longitude, latitude (degrees) and height above the map's zero (metres) of each sensor.
    region : tuple of polygons
        Of interest, longitude and latitude, as are those below; outer rings turn counter-clockwise.
    weighted : tuple of (NamedArea, tuple of polygons)
    """

    site: Site
    deployment: Deployment
    points: Float
    region: tuple[shapely.Polygon, ...]
    weighted: tuple[tuple[NamedArea, tuple[shapely.Polygon, ...]], ...]

    @property
    def sensors(self) -> tuple[Sensor, ...]:
        """The sensors, in the order of the points."""
        return self.deployment.sensors

    def squares(self) -> Float:
        """Return the corners of the square of road round each target, (t, 4, 2) degrees, counter-clockwise."""
        corners = target_squares(self.site.targets).reshape(-1, 3)
        degrees: Float = np.round(_geographic(self.site, corners)[:, :2], DECIMALS)
        return degrees.reshape(-1, 4, 2)

    def seers(self, target: int) -> list[str]:
        """Return the labels of the sensors that see a target."""
        rows = self.deployment.rows
        return [sensor.label for sensor, row in zip(self.sensors, rows, strict=True) if row[target]]

    def patches(self) -> Iterator[tuple[list[str], tuple[shapely.Polygon, ...]]]:
        """Yield for each set of sensors, by their labels, the road that these see and no others."""
        squares = np.round(target_squares(self.site.targets)[:, :, :2], METRE_DECIMALS)
        rows: Boolean = self.deployment.rows.reshape(len(self.sensors), len(squares))
        sets, which = np.unique(rows.T, axis=0, return_inverse=True)
        for number in range(len(sets)):
            own = which.ravel() == number
            area = shapely.coverage_union_all(shapely.polygons(squares[own]))
            yield self.seers(int(np.argmax(own))), _polygons(self.site, area)


def located(geometry: SceneGeometry, site: Site, deployment: Deployment) -> Located | None:
    """Return a placement on WGS 84; None where the projection of the map is not known."""
    points = site.geographic(np.array([sensor.xyz for sensor in deployment.sensors]).reshape(-1, 3))
    if points is None:
        return None
    return Located(
        site,
        deployment,
        np.column_stack([np.round(points[:, :2], DECIMALS), np.round(points[:, 2], 3)]),
        _polygons(site, closed(site.region, GAP)),
        tuple((area, _polygons(site, area.polygon)) for area in geometry.weighted_regions),
    )


def rings(polygon: shapely.Polygon) -> list[list[list[float]]]:
    """Return the corners of a polygon, the outer ring first; the last of each is the first again."""
    return [shapely.get_coordinates(ring).tolist() for ring in (polygon.exterior, *polygon.interiors)]


def missing_sentence(site: Site, files: Sequence[str]) -> str:
    """Say why files that need longitude and latitude are missing; empty where they are not."""
    obstacle = site.geo_reference.obstacle
    return f"{' and '.join(files)} cannot be written: {obstacle}" if obstacle else ""


def _geographic(site: Site, points: Float) -> Float:
    places = site.geographic(points)
    if places is None:
        raise ValueError(site.geo_reference.obstacle)
    return places


def _polygons(site: Site, area: BaseGeometry) -> tuple[shapely.Polygon, ...]:
    """Return the polygons of an area in plan as longitude and latitude; outer rings turn counter-clockwise."""

    def degrees(xy: Float) -> Float:
        return np.round(_geographic(site, np.column_stack([xy, np.zeros(len(xy))]))[:, :2], DECIMALS)

    parts = [part for part in shapely.get_parts(area) if part.geom_type == "Polygon" and not part.is_empty]
    return tuple(shapely.orient_polygons(shapely.transform(part, degrees), exterior_cw=False) for part in parts)
