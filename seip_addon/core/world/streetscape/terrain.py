"""Heights of the ground from triangles, areas draped over them, and embankments next to roads.

Its use is shown in `tests/core/world/streetscape/test_terrain.py`.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...geometry.height_raster import HeightRaster
from ...geometry.plan import plane_height, signed_area

MIN_AREA = 1e-6  # m² in plan: smaller triangles are left out
SNAP_GRID = 1e-6  # grid (metres) that cut outlines snap to; without one slivers arise that cannot be triangulated
ROADSIDE, MAX_ROADSIDE = 5.0, 15.0
"""Width (metres) of the strip next to a road where the ground changes from its height to that of the land."""
EMBANKMENT_RUN = 2.2  # metres of that width for each metre of height between the two
MIN_EMBANKMENT = 0.25  # metres of height from which the strip needs a finer grid than flat ground
STEEP_SPACING = 2.0  # metres, about, between places where the ground is steep
_TOUCHING = 1e-3  # metres from a road within which the ground has its height


@dataclass(frozen=True, eq=False)
class Relief:
    """Heights of the ground under a map, or next to streets that rise above level land.

    Parameters
    ----------
    raster : HeightRaster
        Heights in map coordinates.
    level : float, metres
        Height of the ground in the map.
    bridges : frozenset of str
        Ids of the roads that are straight in height from end to end, independent of the ground between.
    """

    raster: HeightRaster
    level: float
    bridges: frozenset[str] = frozenset()

    def rise(self, xy: Float) -> Float:
        """Return the height of the ground above that of the map (n,) at places (n, 2), metres."""
        return self.raster.at(xy) - self.level

    @property
    def is_level(self) -> bool:
        """Whether the ground is as high as in the map everywhere."""
        return bool((self.raster.heights == self.level).all())


def level_land(level: float) -> Relief:
    """Return level land, at a height in metres, around streets on ramps and bridges and in underpasses."""
    return Relief(HeightRaster(np.zeros(2), 1.0, np.full((1, 1), level)), level)


class Terrain:
    """Heights on a set of triangles that overlap only slightly in plan.

    Parameters
    ----------
    triangles : (n, 3, 3) float64, metres
        Triangles; none may be vertical.
    beside : callable, optional
        Function for the heights (n,) of the ground at places (n, 2) outside all triangles.
    steep : shapely geometry, optional
        Area in plan in which `drape` uses a finer grid.
    """

    def __init__(
        self, triangles: Float, beside: Callable[[Float], Float] | None = None, steep: BaseGeometry | None = None
    ) -> None:
        self._beside, self._steep = beside, steep
        self._triangles = triangles[np.abs(signed_area(triangles)) > MIN_AREA]
        self._plan = shapely.polygons(self._triangles[:, :, :2])
        self._tree = shapely.STRtree(self._plan)

    def height(self, xy: Float) -> Float:
        """Return the heights at points in plan.

        Parameters
        ----------
        xy : (n, 2) float64, metres

        Returns
        -------
        (n,) float64, metres
            Mean height of the triangles there; outside them the height of the ground, or of the nearest triangle point.
        """
        points = shapely.points(xy)
        point, triangle = self._tree.query(points, predicate="intersects")
        # Points on a common edge, or where triangles overlap slightly, meet several triangles: take the mean.
        found = np.bincount(point, minlength=len(xy))
        total = np.bincount(point, plane_height(self._triangles[triangle], xy[point]), minlength=len(xy))
        height: Float = total / np.maximum(found, 1)
        off = found == 0
        height[off] = self._nearest_height(points[off]) if self._beside is None else self._beside(xy[off])
        return height

    def _nearest_height(self, points: NDArray[np.object_]) -> Float:
        """Return the heights (n,) of the nearest points of triangles."""
        nearest = self._tree.nearest(points)
        on_triangle = shapely.get_coordinates(shapely.shortest_line(self._plan[nearest], points))[::2]
        return plane_height(self._triangles[nearest], on_triangle)

    def drape(self, area: BaseGeometry, *, spacing: float, above: float = 0.0) -> Float:
        """Drape an area in plan over the terrain, as triangles with their corners on it and without cracks.

        Parameters
        ----------
        area : shapely geometry
            Area in plan.
        spacing : float, metres
            Side of the square grid that divides the area; a fraction of it is used where the ground is steep.
        above : float, metres
            Height above the terrain.

        Returns
        -------
        (n, 3, 3) float64, metres
            Triangles with normals up.
        """
        plan = triangulate(_cells(area, spacing, self._steep))
        corners = plan.reshape(-1, 2)
        if len(corners) == 0:
            return np.empty((0, 3, 3))
        return _raised(corners, self.height(corners) + above)


class Embankments:
    r"""Heights of the ground next to roads, with slopes between the roads and the land.

    At a road the ground is as high as the road; at a distance :math:`b` and beyond it is as high as the land. A road at
    height :math:`h` above the land raises the ground at a distance :math:`d < b` by

    .. math:: (1 - s) h, \qquad s = \frac{d^2}{d^2 + (b - d)^2}.

    Several roads may be near, as where one climbs next to another one. The ground is raised by the mean over their
    triangles within the greatest width :math:`B`, weighted by :math:`((B - d) / (B d))^4` (after Franke and Little): it
    has the height of each road at its edge, and no steps in between.

    Parameters
    ----------
    triangles : (n, 3, 3) float64, metres
        Surfaces of roads on the ground, without bridges.
    land : callable
        Function for the heights (n,) of the land at places (n, 2).
    """

    def __init__(self, triangles: Float, land: Callable[[Float], Float]) -> None:
        self._land = land
        self._triangles = triangles[np.abs(signed_area(triangles)) > MIN_AREA]
        self._plan = shapely.polygons(self._triangles[:, :, :2])
        self._tree = shapely.STRtree(self._plan)
        corners = self._triangles.reshape(-1, 3)
        above = np.abs(corners[:, 2] - land(corners[:, :2])).reshape(-1, 3).max(axis=1)
        width = embankment_width(above)
        high = above > MIN_EMBANKMENT
        # Only slopes need a fine grid: flat ground next to a road at its own height does not.
        self.steep = shapely.union_all(shapely.buffer(self._plan[high], width[high]))
        self._reach = float(width.max(initial=ROADSIDE))

    def height(self, xy: Float) -> Float:
        """Return the heights of the ground (n,) at places (n, 2), metres."""
        land = self._land(xy)
        points = shapely.points(xy)
        point, triangle = self._tree.query(points, predicate="dwithin", distance=self._reach)
        nearest = shapely.get_coordinates(shapely.shortest_line(self._plan[triangle], points[point]))[::2]
        away = np.hypot(*(xy[point] - nearest).T)
        # The weight falls to zero at the reach, so that a triangle enters the mean without a step, and grows without
        # bound towards the road, so that its height wins there; `_TOUCHING` keeps it finite.
        weight = (np.maximum(self._reach - away, 0.0) / (self._reach * np.maximum(away, _TOUCHING))) ** 4
        above = plane_height(self._triangles[triangle], nearest) - land[point]
        width = embankment_width(np.abs(above))
        away = np.minimum(away, width)
        raised = above * (1 - away**2 / (away**2 + (width - away) ** 2))
        total = np.bincount(point, weight, minlength=len(xy))
        mean = np.bincount(point, weight * raised, minlength=len(xy)) / np.where(total > 0.0, total, 1.0)
        ground: Float = land + mean
        return ground


def embankment_width(height: Float) -> Float:
    """Return the width (n,) of the strip next to roads at heights (n,) above or below the land, metres."""
    width: Float = np.clip(EMBANKMENT_RUN * height, ROADSIDE, MAX_ROADSIDE)
    return width


def _cells(area: BaseGeometry, spacing: float, steep: BaseGeometry | None = None) -> NDArray[np.object_]:
    """Divide an area into polygons by a square grid through the origin.

    Cells that meet a steep area are divided further into squares of about `STEEP_SPACING`.
    """
    if area.is_empty:
        return np.array([], dtype=object)
    low = np.floor(np.array(area.bounds[:2]) / spacing)
    count = np.ceil(np.array(area.bounds[2:]) / spacing) - low
    column, row = np.meshgrid(low[0] + np.arange(count[0]), low[1] + np.arange(count[1]), indexing="ij")
    x, y = column.ravel() * spacing, row.ravel() * spacing
    shapely.prepare(area)
    squares = shapely.box(x, y, x + spacing, y + spacing)
    met = squares[shapely.intersects(area, squares)]
    if steep is not None and not steep.is_empty:
        shapely.prepare(steep)
        divided = shapely.intersects(steep, met)
        low = shapely.bounds(met[divided])[:, :2]
        divisions = max(round(spacing / STEEP_SPACING), 1)
        side = spacing / divisions
        offsets = side * np.stack(np.meshgrid(*[np.arange(divisions)] * 2), axis=-1).reshape(-1, 2)
        x, y = (low[:, None] + offsets).reshape(-1, 2).T
        whole = met[~divided]
        # Cells next to divided ones get the same corners along the common side, so that no cracks open between them.
        border = shapely.segmentize(shapely.boundary(shapely.union_all(met[divided])), side)
        at_border = shapely.intersects(whole, border)
        whole[at_border] = shapely.snap(whole[at_border], shapely.extract_unique_points(border), SNAP_GRID)
        met = np.concatenate([whole, shapely.box(x, y, x + side, y + side)])
    parts = shapely.get_parts(shapely.intersection(met, area, grid_size=SNAP_GRID))
    kept: NDArray[np.object_] = parts[shapely.area(parts) > MIN_AREA]
    return kept


def triangulate(area: BaseGeometry | NDArray[np.object_], least: float = MIN_AREA) -> Float:
    """Return (n, 3, 2) counter-clockwise triangles that fill areas in plan, without additional corners.

    Triangles of at most ``least`` square metres are left out.
    """
    pieces = shapely.get_parts(shapely.constrained_delaunay_triangles(area))
    corners = shapely.get_coordinates(pieces).reshape(-1, 4, 2)[:, :3]
    area = signed_area(corners)
    corners[area < 0] = corners[area < 0, ::-1]
    kept: Float = corners[np.abs(area) > least]
    return kept


def cut(triangles: Float, away: BaseGeometry) -> Float:
    """Return (n, 3, 3) triangles without the part within an area in plan."""
    if len(triangles) == 0:
        return triangles
    plan = shapely.polygons(triangles[:, :, :2])
    shapely.prepare(away)
    touched = shapely.intersects(away, plan)
    # Only triangles that touch the area are cut. The pieces lie in the plane of their triangle, so that the surface
    # stays the same.
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
    """Return (n, 3, 3) triangles from their corners in plan (3 n, 2) and heights (3 n,)."""
    return np.column_stack([corners, height]).reshape(-1, 3, 3)
