"""Triangles in plan: areas, outlines and heights; and robust operations on areas."""

from collections.abc import Iterable
from typing import Literal

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..base.arrays import Boolean, Float, Integer

MIN_AREA = 1e-9  # square metres in plan; smaller triangles are vertical and cover no area

_OVERLAY_GRID = 1e-4
_TWIN_DISTANCE = 1e-9  # metres between corners that count as one

_MAX_MITRE = 2.0  # largest ratio of the length of a mitre to the distance by which a line is moved

_BARYCENTRIC_SLACK = 1e-6  # slack in barycentric coordinates, so that no point falls between two triangles


def signed_area(triangles: Float) -> Float:
    """Return the areas (n,) of triangles (n, 3, 2 or 3) in plan, positive for counter-clockwise triangles."""
    along, across = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    area: Float = (along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]) / 2
    return area


def outline(triangles: Float, grid: float = 1e-3) -> BaseGeometry:
    """Return the union in plan of triangles (n, 3, 2 or 3), with corners rounded to a grid in metres.

    If the union fails on that grid, corners are rounded to 0.1 mm.
    """
    lying = triangles[np.abs(signed_area(triangles)) > MIN_AREA, :, :2]
    polygons = shapely.polygons(lying)
    try:
        return shapely.union_all(polygons, grid_size=grid)
    except shapely.errors.GEOSException:  # slivers may cross themselves once their corners are rounded
        return shapely.union_all(polygons, grid_size=_OVERLAY_GRID)


def without(area: BaseGeometry, away: BaseGeometry) -> BaseGeometry:
    """Return an area (or lines) in plan without another area; on a grid of 0.1 mm if that fails by rounding."""
    try:
        return area.difference(away)
    except shapely.errors.GEOSException:
        sound = area.buffer(0) if shapely.get_dimensions(area) == 2 else area
        return shapely.difference(sound, away.buffer(0), grid_size=_OVERLAY_GRID)


def united(areas: Iterable[BaseGeometry]) -> BaseGeometry:
    """Return the union of areas in plan that may cross themselves, with corners rounded to a grid of 0.1 mm."""
    return shapely.union_all([shapely.make_valid(area) for area in areas], grid_size=_OVERLAY_GRID)


def closed(area: BaseGeometry, gap: float, join: Literal["mitre", "round"] = "mitre") -> BaseGeometry:
    """Return an area in plan with cracks and gaps up to twice ``gap`` metres filled.

    Mitred joins bring straight edges and corners back to where they were. Where the gap is wider than the bends of the
    outline, they fill more than the gap; round joins do not.
    """
    wider = _without_twins(area).buffer(gap, join_style=join)  # morphological closing
    return _narrower(_without_twins(wider), gap, join)


def opened(area: BaseGeometry, width: float) -> BaseGeometry:
    """Return an area in plan without parts narrower than ``width`` metres; corners of more than 23 degrees stay."""
    return _narrower(area, width / 2, "mitre").buffer(width / 2, join_style="mitre")  # morphological opening


def _narrower(area: BaseGeometry, by: float, join: Literal["mitre", "round"]) -> BaseGeometry:
    """Return an area in plan without a strip of a width in metres along its outline."""
    narrower = area.buffer(-by, join_style=join)
    # GEOS may return nothing where an edge is a few micrometres long; corners are rounded first in that case
    lost = narrower.area < area.area - 2 * by * area.length
    return shapely.set_precision(area, _OVERLAY_GRID).buffer(-by, join_style=join) if lost else narrower


def _without_twins(area: BaseGeometry) -> BaseGeometry:
    """Return an area with distinct corners: unions leave some that differ only by rounding.

    Edges between such corners have almost no length, or turn back on themselves, and a mitred buffer is not defined.
    """
    corners = np.unique(shapely.get_coordinates(area), axis=0)
    apart = np.unique(np.round(corners / _TWIN_DISTANCE), axis=0)
    if len(apart) == len(corners):
        return area
    # A union on a grid may touch itself in a corner, which is not valid and cannot be rounded again.
    return shapely.set_precision(area if area.is_valid else area.buffer(0), _TWIN_DISTANCE)


def travelled(line: Float) -> Float:
    """Return the distance in plan from the start of a line (n, 2 or 3) to each of its points, (n,) metres."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line[:, :2], axis=0).T))])


def beside(line: Float, aside: float) -> Float:
    """Return a line (n, 2 or 3) moved to its left by ``aside`` metres in plan, with mitred corners."""
    steps = np.diff(line[:, :2], axis=0)
    units = steps / np.maximum(np.hypot(*steps.T), 1e-9)[:, None]
    before, after = np.concatenate([units[:1], units]), np.concatenate([units, units[-1:]])
    # The normals of both pieces at a corner, (a + b) / (1 + a·b), have the offset of both edges: the mitre.
    cosine = (before * after).sum(axis=1, keepdims=True)
    along = (before + after) / np.maximum(1.0 + cosine, 2.0 / _MAX_MITRE**2)
    moved = line.copy()
    moved[:, :2] += aside * np.column_stack([-along[:, 1], along[:, 0]])
    return moved


def plane_height(triangles: Float, plan: Float) -> Float:
    """Return the height (n,) of each triangle's plane (n, 3, 3) at its point in plan (n, 2)."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    offset = plan - triangles[:, 0, :2]
    height: Float = triangles[:, 0, 2] - (normal[:, :2] * offset).sum(axis=1) / normal[:, 2]
    return height


def surface_height(plan: Float, triangles: Float) -> Float:
    """Return the height of the highest surface above or below each point in plan.

    Parameters
    ----------
    plan : (n, 2) float64, metres
    triangles : (m, 3, 3) float64, metres

    Returns
    -------
    (n,) float64, metres
        Heights, NaN if no triangle lies above or below the point.

    Examples
    --------
    A ramp that climbs from 0 to 1 m over 20 m, at a point halfway up and at one beside it:

    >>> corners = np.array([[0.0, 0.0, 0.0], [20.0, 0.0, 1.0], [20.0, 4.0, 1.0], [0.0, 4.0, 0.0]])
    >>> ramp = corners[[[0, 1, 2], [0, 2, 3]]]
    >>> surface_height(np.array([[10.0, 3.0], [10.0, 6.0]]), ramp).tolist()
    [0.5, nan]
    >>> outline(ramp).area
    80.0
    """
    point, heights = heights_over(plan, triangles)
    height = np.full(len(plan), -np.inf)
    np.maximum.at(height, point, heights)
    height[np.isneginf(height)] = np.nan
    return height


def heights_over(plan: Float, triangles: Float) -> tuple[Integer, Float]:
    """Return the heights of all surfaces above or below each point in plan.

    Parameters
    ----------
    plan : (n, 2) float64, metres
    triangles : (m, 3, 3) float64, metres

    Returns
    -------
    point : (k,) int64
        Index of a point in plan; an index may occur several times, or not at all.
    height : (k,) float64, metres
        Height of a surface there.
    """
    lying = triangles[np.abs(signed_area(triangles)) > MIN_AREA]
    low, high = lying[:, :, :2].min(axis=1), lying[:, :, :2].max(axis=1)
    tree = shapely.STRtree(shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1]))
    point, near = tree.query(shapely.points(plan), predicate="intersects")
    above = _covers(lying[near], plan[point])
    return point[above], plane_height(lying[near[above]], plan[point[above]])


def _covers(triangles: Float, plan: Float) -> Boolean:
    """Return whether each triangle (n, 3, 3) covers its point (n, 2) in plan, by barycentric coordinates."""
    corners = triangles[:, :, :2]
    # Areas of the triangles between the point and each side: corners[i - 2] is the corner after corners[i].
    opposite = [signed_area(np.stack([corners[:, i], corners[:, i - 2], plan], axis=1)) for i in range(3)]
    inside: Boolean = (np.stack(opposite) / signed_area(triangles) >= -_BARYCENTRIC_SLACK).all(axis=0)
    return inside
