"""Surfaces of lanes as strips between a left and a right edge."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...base.errors import SeipError
from ...base.limits import ELEVATION
from .road_map import Lane, LaneSection, Road, RoadFrame, lifted
from .sampling import sample

_MIN_TRIANGLE_AREA = 1e-9  # square metres
_MAX_HEIGHT, _MAX_WIDTH = ELEVATION.most, 1_000.0  # metres; values beyond are errors of the map
_MAX_OFFSET = 5_000.0  # metres of a lane's edge from the reference line; likewise


@dataclass(frozen=True, eq=False)
class LaneSurface:
    """The surface of a lane over one lane section.

    Parameters
    ----------
    section : int
        Number of the lane section along the road, from 0.
    lane_id : int
        Positive to the left of the centre lane, negative to the right.
    lane_type : str
        Type as in the file: ``driving``, ``shoulder``, ``sidewalk``, ``parking``, ...
    s : (n,) float64, metres
        Stations of the edge points along the road.
    left, right : (n, 3) float64, metres
        Edges in map coordinates, as seen along the reference line.

    Examples
    --------
    >>> left = np.array([[0.0, 0.0, 0.0], [50.0, 0.0, 1.0], [100.0, 0.0, 2.0]])
    >>> lane = LaneSurface("1", None, 0, -1, "driving", False, left[:, 0], left, left - [0.0, 3.5, 0.0])
    >>> lane.triangles.shape, round(lane.polygon.area)
    ((4, 3, 3), 350)
    """

    road_id: str
    junction_id: str | None
    section: int
    lane_id: int
    lane_type: str
    keeps_left: bool
    s: Float
    left: Float
    right: Float

    @cached_property
    def triangles(self) -> Float:
        """Surface as (m, 3, 3) float64 triangles in map coordinates, with normals up, without empty triangles."""
        left, right = self.left, self.right
        near_right = np.stack([right[:-1], right[1:], left[1:]], axis=1)
        near_left = np.stack([right[:-1], left[1:], left[:-1]], axis=1)
        triangles = np.stack([near_right, near_left], axis=1).reshape(-1, 3, 3)
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        # In a bend with a radius below the distance from the reference line the strip folds over: turn such faces up.
        upward = np.where((normals[:, 2] < 0.0)[:, None, None], triangles[:, ::-1], triangles)
        return np.asarray(upward[np.linalg.norm(normals, axis=1) > 2.0 * _MIN_TRIANGLE_AREA])

    @cached_property
    def polygon(self) -> BaseGeometry:
        """Surface in plan; several polygons if its width is zero in between."""
        outline = Polygon(np.concatenate([self.left[:, :2], self.right[::-1, :2]]))
        if outline.is_valid:
            return outline
        faces = shapely.polygons(self.triangles[:, :, :2])
        return shapely.union_all(faces[shapely.is_valid(faces)])


def lane_surfaces(road: Road, tolerance: float = 0.02) -> tuple[LaneSurface, ...]:
    """Return the surfaces of all lanes of a road that have an area.

    They include elevation, superelevation, crossfall, shape, level lanes and lane heights; across, a lane is straight
    from edge to edge. Lane sections shorter than a micrometre are left out.

    Parameters
    ----------
    road : Road
        Road of the map.
    tolerance : float, metres
        Greatest distance between a true edge and the straight lines that approximate it.

    Returns
    -------
    tuple of LaneSurface
        Sections along the road, lanes from left to right.

    Raises
    ------
    SeipError
        The road cannot be followed within the tolerance.
    """
    surfaces = []
    for number, section in enumerate(road.sections):
        lanes, place = (*section.left[::-1], *section.right), f"road {road.id}, lane section at s={section.start:g}"
        if not lanes:
            continue
        s, points = sample(partial(_edges, road, section), _knots(road, section), tolerance, place)
        points = points.reshape(-1, len(lanes), 2, 3)
        _check_size(points, np.stack(road.reference_line(s)[:2], axis=-1), place)
        for lane, edges in zip(lanes, np.moveaxis(points, 1, 0), strict=True):
            of_road = (road.id, road.junction_id, number, lane.id, lane.type, road.keeps_left)
            surfaces.append(LaneSurface(*of_road, s, edges[:, 0], edges[:, 1]))
    return tuple(surface for surface in surfaces if len(surface.triangles))


def _check_size(points: Float, centre: Float, place: str) -> None:
    """Raise an error if edges of lanes, (k, lanes, 2, 3), are implausibly high, or far from each other or the road."""
    highest = float(np.abs(points[..., 2]).max(initial=0.0))
    if highest > _MAX_HEIGHT:
        raise SeipError(f"{place}: it lies at {highest:,.0f} m above or below zero; correct the elevation in the map")
    widest = float(np.linalg.norm(points[:, :, 0] - points[:, :, 1], axis=-1).max(initial=0.0))
    if widest > _MAX_WIDTH:
        raise SeipError(f"{place}: a lane is {widest:,.0f} m wide; correct its width in the map")
    farthest = float(np.linalg.norm(points[..., :2] - centre[:, None, None], axis=-1).max(initial=0.0))
    if farthest > _MAX_OFFSET:
        raise SeipError(f"{place}: a lane lies {farthest:,.0f} m beside the road; correct its <laneOffset> in the map")


def _knots(road: Road, section: LaneSection) -> list[float]:
    """Return the ends of a section and the stations in between where a record begins or a width becomes zero."""
    lanes = (*section.left, *section.right)
    profiles = (
        *(road.elevation, road.superelevation, road.left_crossfall, road.right_crossfall, road.lane_offset),
        *(of_lane for lane in lanes for of_lane in (lane.width, lane.border, lane.inner_height, lane.outer_height)),
    )
    # Widths below zero count as zero (`_width`), which gives the edge a kink at the zero: it needs a point there.
    vanishing = (lane.width.zeros(section.end) for lane in lanes)
    starts = np.concatenate([road.reference_line.s, road.shape.s, *(p.start for p in profiles), *vanishing])
    inside = starts[(starts > section.start) & (starts < section.end)]
    return [section.start, *inside.tolist(), section.end]


def _edges(road: Road, section: LaneSection, s: Float) -> Float:
    """Return the left and right edge of each lane, lanes from left to right, (k, 2 · lanes, 3) metres."""
    frame = road.frame(s)
    left = [edges[::-1] for edges in _side_edges(road, frame, section.left, s, 1.0)][::-1]
    right = _side_edges(road, frame, section.right, s, -1.0)
    return np.stack([edge for edges in (*left, *right) for edge in edges], axis=1)


def _side_edges(
    road: Road, frame: RoadFrame, lanes: tuple[Lane, ...], s: Float, side: float
) -> Iterator[tuple[Float, Float]]:
    """Yield the inner and outer edge, (k, 3) each, of the lanes of one side from the centre outwards."""
    centre = t = road.lane_offset(s)
    left_slope, right_slope = -np.tan(road.left_crossfall(s)), np.tan(road.right_crossfall(s))

    def rise(t: Float) -> Float:
        return np.asarray(t * np.where(t > 0.0, left_slope, right_slope) + road.shape(s, t))

    point = frame.origin + t[:, None] * frame.left + rise(t)[:, None] * frame.up
    for lane in lanes:
        # Lanes are built outwards, each from the outer edge of the one before. A level lane continues horizontally from
        # there; other lanes follow the cross section of the road.
        width = _width(lane, s, np.abs(t - centre))
        outer_t = t + side * width
        if lane.level:
            step = (side * width)[:, None] * frame.level_left
        else:
            step = (outer_t - t)[:, None] * frame.left + (rise(outer_t) - rise(t))[:, None] * frame.up
        yield lifted(point, lane.inner_height(s)), lifted(point + step, lane.outer_height(s))
        point, t = point + step, outer_t


def _width(lane: Lane, s: Float, inner: Float) -> Float:
    """Return the width, (k,) metres, of a lane whose inner edge is ``inner`` away from the centre."""
    if len(lane.width) or not len(lane.border):
        return np.maximum(lane.width(s), 0.0)
    # Some exporters give the borders of right lanes as t, some as distances: the side is known anyway.
    return np.maximum(np.abs(lane.border(s)) - inner, 0.0)
