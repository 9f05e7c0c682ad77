"""Possible road users of a site: bodies and positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Boolean, Float, Integer
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
    """Road users at m points: all bodies at each point of the carriageway, a pedestrian at each point of a kerb line.

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
    """

    xyz: Float
    body: Integer
    weight: Float
    central: Boolean
    crossing: Integer
    crossings: tuple[str, ...]

    def __len__(self) -> int:
        """Return the number of road users."""
        return len(self.xyz)


def road_users(geometry: SceneGeometry, spacing: float = SPACING) -> RoadUsers:
    """Place road users in a scene's region: all bodies on the carriageway, and pedestrians at the edges of pavements.

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
    edge = _kerb_points(geometry, outline(road).intersection(geometry.region), spacing)
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
    )


def _kerb_points(geometry: SceneGeometry, road: BaseGeometry, spacing: float) -> Float:
    """Return evenly spaced points of waiting pedestrians on pavements along the carriageway, (e, 3) float64, metres."""
    lines = _inset_edges(geometry.candidate_areas, road)
    along = [shapely.line_interpolate_point(line, _marks(line.length, spacing)) for line in lines]
    points = np.concatenate([np.zeros(0, dtype=object), *along])
    plan = shapely.get_coordinates(points[_faces_road(points, geometry.candidate_areas, road)])
    return _on_surface(plan, geometry)


def _inset_edges(pavement: BaseGeometry, road: BaseGeometry) -> Sequence[BaseGeometry]:
    """Return the lines in pavements at `KERB_DISTANCE` from their edges, near the carriageway."""
    line = pavement.buffer(-KERB_DISTANCE).boundary.intersection(road.buffer(FARTHEST_EDGE))
    # A line that only touches the buffer gives a single point, which a MultiLineString cannot hold.
    parts = [part for part in shapely.get_parts(line) if part.length > 0]
    # A boundary starts at an arbitrary vertex, and the intersection cuts it there too. Merged and normalised, the lines
    # depend on the shape only, and so do the points that are spaced along them.
    edges: Sequence[BaseGeometry] = shapely.get_parts(
        shapely.normalize(shapely.line_merge(shapely.MultiLineString(parts)))
    )
    return edges


def _faces_road(points: NDArray[np.object_], pavement: BaseGeometry, road: BaseGeometry) -> Boolean:
    """Return the mask of points on the side of a pavement that faces the carriageway, (k,) bool."""
    # The inset line runs around the whole pavement. From its side at the kerb, the shortest way to the road leaves the
    # pavement after `KERB_DISTANCE`; from its far side, the way crosses the width of the pavement first. The factor 2
    # allows for ways that leave obliquely, as at corners.
    way = shapely.shortest_line(points, road)
    on_pavement = shapely.length(shapely.intersection(way, pavement))
    faces: Boolean = (shapely.length(way) <= FARTHEST_EDGE) & (on_pavement <= 2 * KERB_DISTANCE)
    return faces


def _on_surface(plan: Float, geometry: SceneGeometry) -> Float:
    """Return points in plan (k, 2) at the height of the ground, in a fixed order, without those that have no ground."""
    height = surface_height(plan, joined((*geometry.ground, *geometry.roads)))
    has_ground = np.isfinite(height)
    # rounding to a micrometre removes the numerical noise of a distant map origin
    points: Float = np.round(np.column_stack([plan[has_ground], height[has_ground]]), 6)
    # sorted by x, then y, then z: shapely does not promise an order of the parts of a geometry
    ordered: Float = points[np.lexsort(points.T[::-1])]
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
