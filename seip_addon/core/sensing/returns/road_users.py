"""Possible road users of a site: bodies and positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...arrays import Boolean, Float, Integer
from ...geometry.plan import outline, surface_height
from ...site.scene_geometry import NamedArea, SceneGeometry, joined
from ...site.targets import generate_targets
from .bodies import PANELS

BODIES = tuple(PANELS)
KERB_DISTANCE = 0.5  # metres from the edge of the pavement to waiting pedestrians
FARTHEST_EDGE = 4.0  # metres from the carriageway to the farthest pavement's edge: parking and cycle lanes lie between
SPACING = 2.0  # metres between neighbouring road users: less than the length of a car


@dataclass(frozen=True, eq=False)
class RoadUsers:
    """Road users at m points: all bodies at each point of the carriageway, a pedestrian at each of a pavement's edge.

    Parameters
    ----------
    xyz : (m, 3) float64, metres
        Points on the ground, local site axes.
    body : (m,) int64
        Index into `BODIES`.
    weight : (m,) float64
        Importance in the weighted problem, 1 outside every weighted region.
    central : (m,) bool
        Whether the point lies in some weighted region.
    crossing : (m,) int64
        Index of the crossing that a pedestrian stands on; -1 elsewhere.
    crossings : tuple of str
        Names of the crossings.
    spacing : float, metres
        Distance between neighbouring road users.
    """

    xyz: Float
    body: Integer
    weight: Float
    central: Boolean
    crossing: Integer
    crossings: tuple[str, ...]
    spacing: float

    def __len__(self) -> int:
        """Return the number of road users."""
        return len(self.xyz)


def road_users(geometry: SceneGeometry, spacing: float = SPACING) -> RoadUsers:
    """Place road users in a scene's region: all bodies on the carriageway, pedestrians at the edges of pavements too.

    Parameters
    ----------
    spacing : float, metres
        Distance between neighbouring road users.

    Raises
    ------
    SeipError
        Same as for `generate_targets`.
    """
    road = joined(geometry.roads)
    on_road = generate_targets(geometry.region, road, spacing, geometry.weighted_regions)
    edge = _pavement_edge(geometry, outline(road).intersection(geometry.region), spacing)
    weight, central = _weights(edge, geometry.weighted_regions)
    xyz = np.concatenate([*[on_road.xyz] * len(BODIES), edge])
    body = np.repeat(np.arange(len(BODIES)), len(on_road))
    body = np.concatenate([body, np.full(len(edge), BODIES.index("pedestrian"))])
    areas = [area for area in geometry.places if area.crossing]
    crossing = np.full(len(xyz), -1)
    on_foot = np.flatnonzero(body == BODIES.index("pedestrian"))
    for number, area in enumerate(areas):
        crossing[on_foot[shapely.intersects_xy(area.polygon, *xyz[on_foot, :2].T)]] = number
    return RoadUsers(
        xyz=xyz,
        body=body,
        weight=np.concatenate([*[on_road.weight] * len(BODIES), weight]),
        central=np.concatenate([*[on_road.central] * len(BODIES), central]),
        crossing=crossing,
        crossings=tuple(area.name for area in areas),
        spacing=spacing,
    )


def _pavement_edge(geometry: SceneGeometry, road: BaseGeometry, spacing: float) -> Float:
    """Return evenly spaced points at the pavements' edges towards the carriageway, (e, 3) float64."""
    pavement = geometry.candidate_areas
    line = pavement.buffer(-KERB_DISTANCE).boundary.intersection(road.buffer(FARTHEST_EDGE))
    parts = [part for part in shapely.get_parts(line) if part.length > 0]
    merged = shapely.normalize(shapely.line_merge(shapely.MultiLineString(parts)))
    along = [shapely.line_interpolate_point(part, _marks(part.length, spacing)) for part in shapely.get_parts(merged)]
    points = np.concatenate([np.zeros(0, dtype=object), *along])
    way = shapely.shortest_line(points, road)
    inside = shapely.length(shapely.intersection(way, pavement))
    points = points[(shapely.length(way) <= FARTHEST_EDGE) & (inside <= 2 * KERB_DISTANCE)]
    plan = shapely.get_coordinates(points)
    height = surface_height(plan, joined((*geometry.ground, *geometry.roads)))
    there = np.isfinite(height)
    # rounding to a micrometre removes the numerical noise of a distant map origin
    edge: Float = np.round(np.column_stack([plan[there], height[there]]), 6)
    ordered: Float = edge[np.lexsort(edge.T[::-1])]
    return ordered


def _marks(length: float, spacing: float) -> Float:
    """Return evenly spaced distances along a line, half a spacing from its ends, (k,) float64."""
    count = max(1, round(length / spacing))
    marks: Float = (np.arange(count) + 0.5) * (length / count)
    return marks


def _weights(xyz: Float, regions: Sequence[NamedArea]) -> tuple[Float, Boolean]:
    weight, central = np.ones(len(xyz)), np.zeros(len(xyz), dtype=bool)
    for area in regions:
        inside = shapely.intersects_xy(area.polygon, *xyz[:, :2].T)
        weight[inside] *= area.weight
        central |= inside
    return weight, central
