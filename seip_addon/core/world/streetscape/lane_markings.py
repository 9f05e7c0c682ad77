"""Lines painted on a street: along its lanes, and where these enter junctions."""

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...geometry.plan import without
from ..opendrive.lanes import LaneSurface
from .road_surface import group, in_groups, inner_edge, interpolated, outer_edge

MARKING_WIDTH = 0.12
MARKING_ABOVE = 0.012
DASH_LENGTH, DASH_GAP = 3.0, 6.0
MIN_PAINT, MAX_PAINTED_TWICE = 1e-9, 0.1  # least area of paint (m²), and share of it that may be painted twice
STOP_LINE_WIDTH = 0.4
STOP_LINE_SETBACK = 1.0
MIN_MARKED_WIDTH = 1.0  # metres: lanes narrower than this somewhere are tapers, and have no markings


def markings(surfaces: Sequence[LaneSurface], extent: BaseGeometry, inside: BaseGeometry) -> Float:
    """Return (n, 4, 3) quads of the lines along driving lanes, up to the stop lines of junctions.

    Parameters
    ----------
    surfaces : sequence of LaneSurface
        Lanes in local axes.
    extent : shapely geometry
        Area to which the lines are cut, as the surfaces are.
    inside : shapely geometry
        Area of the junctions.
    """
    lanes = {(lane.road_id, lane.section, lane.lane_id): lane for lane in surfaces if lane.junction_id is None}
    painted = without(extent, inside.buffer(STOP_LINE_SETBACK + STOP_LINE_WIDTH))
    shapely.prepare(painted)
    quads = [np.empty((0, 4, 3))]
    for (road, section, number), lane in lanes.items():
        if group(lane) != "driving" or _is_taper(lane):
            continue
        # Lane ids count outwards from the reference line, left lanes positive and right lanes negative, without 0: the
        # inner neighbour of lane 1 is lane -1.
        away = 1 if number > 0 else -1
        inner = lanes.get((road, section, number - away if number != away else -away))
        outer = lanes.get((road, section, number + away))
        divides = inner is not None and group(inner) == "driving"
        if number != -1 or not divides:  # the middle line is painted once, by lane 1
            quads += _line(inner_edge(lane), painted, dashed=divides and number != away)
        if outer is not None and group(outer) in ("shoulder", "biking", "parking", "border"):
            quads += _line(outer_edge(lane), painted, dashed=False)
    return _painted_once(np.concatenate(quads))


def _painted_once(quads: Float) -> Float:
    """Return the quads (n, 4, 3) that do not lie on an earlier one.

    The two directions of a street may be separate roads with the same line as an edge.
    """
    plan = shapely.polygons(quads[:, :, :2])
    plan = np.where(shapely.is_valid(plan), plan, shapely.convex_hull(plan))
    # Each quad is compared with the earlier ones only, so that of two equal quads the first one remains.
    later, earlier = shapely.STRtree(plan).query(plan, predicate="intersects")
    later, earlier = later[earlier < later], earlier[earlier < later]
    shared = shapely.area(shapely.intersection(plan[later], plan[earlier]))
    covered = np.bincount(later, shared, minlength=len(quads)) / np.maximum(shapely.area(plan), MIN_PAINT)
    kept: Float = quads[covered <= MAX_PAINTED_TWICE]
    return kept


def stop_lines(surfaces: Sequence[LaneSurface], inside: BaseGeometry) -> Float:
    """Return (n, 4, 3) quads of stop lines where driving lanes enter junctions, whose area is given."""
    inside = inside.buffer(0.3)
    shapely.prepare(inside)
    quads = [np.empty((0, 4, 3))]
    for lane in in_groups(surfaces, ["driving"]):
        # Right lanes lead along the reference line and left lanes against it; with left-hand traffic the other way
        # round.
        forward = (lane.lane_id < 0) != lane.keeps_left
        left, right = (lane.left, lane.right) if forward else (lane.right[::-1], lane.left[::-1])
        end = shapely.Point((left[-1, :2] + right[-1, :2]) / 2)
        if lane.junction_id is None and inside.contains(end) and not _is_taper(lane):
            quads.append(_bar(left, right))
    return np.concatenate(quads)


def _is_taper(lane: LaneSurface) -> bool:
    return bool(np.hypot(*(lane.left - lane.right)[:, :2].T).min() < MIN_MARKED_WIDTH)


def _line(edge: Float, painted: BaseGeometry, *, dashed: bool) -> list[Float]:
    """Return quads of a painted line along a lane's edge (n, 3) within an area."""
    rest = shapely.line_merge(shapely.LineString(edge).intersection(painted))
    parts = [part for part in shapely.get_parts(rest) if part.length > 0.0]
    paths = [shapely.get_coordinates(part, include_z=True) for part in parts]
    return [_ribbon(piece) for path in paths for piece in (_dashes(path) if dashed else [path])]


def _dashes(path: Float) -> list[Float]:
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    begins = np.arange(0.0, travelled[-1] - DASH_LENGTH, DASH_LENGTH + DASH_GAP)
    ends = np.stack([begins, begins + DASH_LENGTH], axis=1).reshape(-1)
    return list(interpolated(ends, travelled, path).reshape(-1, 2, 3))


def _ribbon(path: Float) -> Float:
    """Return quads of marking width along a path (n, 3)."""
    path = path[np.concatenate([[True], np.hypot(*np.diff(path[:, :2], axis=0).T) > 1e-6])]
    if len(path) < 2:
        return np.empty((0, 4, 3))
    along = np.gradient(path[:, :2], axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)  # an edge that turns back has no direction
    aside = np.column_stack([-along[:, 1], along[:, 0], np.zeros(len(path))]) * (MARKING_WIDTH / 2)
    left, right = path + aside + [0, 0, MARKING_ABOVE], path - aside + [0, 0, MARKING_ABOVE]
    return np.stack([right[:-1], right[1:], left[1:], left[:-1]], axis=1)


def _bar(left: Float, right: Float) -> Float:
    """Return the stop line (1, 4, 3) near the end of a lane between two edges (n, 3)."""
    near, far = STOP_LINE_SETBACK, STOP_LINE_SETBACK + STOP_LINE_WIDTH
    corners = np.concatenate([_before_end(right, [far, near]), _before_end(left, [near, far])])
    bar: Float = corners[None] + np.array([0.0, 0.0, MARKING_ABOVE])
    return bar


def _before_end(path: Float, distances: Sequence[float]) -> Float:
    """Return points (k, 3) at distances (metres) before the end of a path (n, 3)."""
    left_over = np.cumsum(np.linalg.norm(np.diff(path[::-1], axis=0), axis=1))
    return interpolated(np.array(distances), np.array([0.0, *left_over]), path[::-1])
