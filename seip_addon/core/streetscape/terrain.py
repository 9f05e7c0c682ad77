"""The height of the ground: looked up on triangles, and areas in plan laid on them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from ..arrays import Float
from ..geometry.height_raster import HeightRaster
from ..geometry.plan import plane_height, signed_area

MIN_AREA = 1e-6  # triangles smaller than this in plan (m²) carry nothing and are left out
SNAP_GRID = 1e-6  # grid (metres) that cut outlines snap to; without one slivers arise that cannot be triangulated
ROADSIDE = 5.0  # metres beside the lanes over which their heights go over into those of the ground beyond


@dataclass(frozen=True, eq=False)
class Relief:
    """Heights of the ground that a flat map is laid on.

    Parameters
    ----------
    raster : HeightRaster
        Map coordinates.
    level : float, metres
        Height that the map gives the ground.
    bridges : frozenset of str
        Ids of the roads that lead straight from end to end, whatever the ground is between.
    """

    raster: HeightRaster
    level: float
    bridges: frozenset[str] = frozenset()

    def rise(self, xy: Float) -> Float:
        """Return how far the ground lies above the map's own (n,) at places (n, 2), metres."""
        return self.raster.at(xy) - self.level


class Terrain:
    """Heights on a set of triangles that overlap at most slightly in plan.

    Parameters
    ----------
    triangles : (n, 3, 3) float64, metres
        None of them upright.
    beyond : callable, optional
        Heights (n,) of the ground at places (n, 2), `ROADSIDE` metres and more beside the triangles.
    """

    def __init__(self, triangles: Float, beyond: Callable[[Float], Float] | None = None) -> None:
        self._beyond = beyond
        self._triangles = triangles[np.abs(signed_area(triangles)) > MIN_AREA]
        self._plan = shapely.polygons(self._triangles[:, :, :2])
        self._tree = shapely.STRtree(self._plan)

    def height(self, xy: Float) -> Float:
        """Return the height below or above points in plan.

        Parameters
        ----------
        xy : (n, 2) float64, metres

        Returns
        -------
        (n,) float64, metres
            The mean of the triangles there; beside all, the height at the nearest point of one, or the ground beyond.
        """
        points = shapely.points(xy)
        nearest = self._tree.nearest(points)
        on_triangle = shapely.get_coordinates(shapely.shortest_line(self._plan[nearest], points))[::2]
        height = plane_height(self._triangles[nearest], on_triangle)
        if self._beyond is not None:
            share = np.minimum(np.hypot(*(xy - on_triangle).T) / ROADSIDE, 1.0)
            height = (1 - share) * height + share * self._beyond(xy)
        point, triangle = self._tree.query(points, predicate="intersects")
        found = np.bincount(point, minlength=len(xy))
        total = np.bincount(point, plane_height(self._triangles[triangle], xy[point]), minlength=len(xy))
        return np.where(found > 0, total / np.maximum(found, 1), height)

    def drape(self, area: BaseGeometry, *, spacing: float, above: float = 0.0) -> Float:
        """Return an area in plan as triangles that lie on the terrain at their corners, without cracks.

        Parameters
        ----------
        area : shapely geometry
        spacing : float, metres
            Side of the square grid along which the area is divided.
        above : float, metres
            Height over the terrain.

        Returns
        -------
        (n, 3, 3) float64, metres
            Normals up.
        """
        plan = triangulate(_cells(area, spacing))
        corners = plan.reshape(-1, 2)
        if len(corners) == 0:
            return np.empty((0, 3, 3))
        return _raised(corners, self.height(corners) + above)


def _cells(area: BaseGeometry, spacing: float) -> NDArray[np.object_]:
    """Return the polygons that a square grid through the origin divides an area into."""
    if area.is_empty:
        return np.array([], dtype=object)
    low = np.floor(np.array(area.bounds[:2]) / spacing)
    count = np.ceil(np.array(area.bounds[2:]) / spacing) - low
    column, row = np.meshgrid(low[0] + np.arange(count[0]), low[1] + np.arange(count[1]), indexing="ij")
    x, y = column.ravel() * spacing, row.ravel() * spacing
    shapely.prepare(area)
    squares = shapely.box(x, y, x + spacing, y + spacing)
    met = squares[shapely.intersects(area, squares)]
    parts = shapely.get_parts(shapely.intersection(met, area, grid_size=SNAP_GRID))
    kept: NDArray[np.object_] = parts[shapely.area(parts) > MIN_AREA]
    return kept


def triangulate(area: BaseGeometry | NDArray[np.object_]) -> Float:
    """Return (n, 3, 2) counter-clockwise triangles that fill areas in plan, with no corners of their own."""
    pieces = shapely.get_parts(shapely.constrained_delaunay_triangles(area))
    corners = shapely.get_coordinates(pieces).reshape(-1, 4, 2)[:, :3]
    area = signed_area(corners)
    corners[area < 0] = corners[area < 0, ::-1]
    kept: Float = corners[np.abs(area) > MIN_AREA]
    return kept


def cut(triangles: Float, away: BaseGeometry) -> Float:
    """Return (n, 3, 3) triangles without what lies in an area in plan."""
    if len(triangles) == 0:
        return triangles
    plan = shapely.polygons(triangles[:, :, :2])
    shapely.prepare(away)
    touched = shapely.intersects(away, plan)
    rests = shapely.difference(plan[touched], away, grid_size=SNAP_GRID)
    pieces = [triangles[~touched]]
    for triangle, rest in zip(triangles[touched], rests, strict=True):
        if rest.area > MIN_AREA:
            corners = triangulate(rest)
            flat = corners.reshape(-1, 2)
            height = plane_height(np.broadcast_to(triangle, (len(flat), 3, 3)), flat)
            pieces.append(_raised(flat, height))
    return np.concatenate(pieces)


def _raised(corners: Float, height: Float) -> Float:
    """Return (n, 3, 3) triangles of their corners in plan (3 n, 2) and heights (3 n,)."""
    return np.column_stack([corners, height]).reshape(-1, 3, 3)
