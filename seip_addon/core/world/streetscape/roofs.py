"""Buildings as closed solids: walls around an outline with courtyards, and a flat, sloped or ridged roof."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
import shapely

from ...arrays import Float
from ...geometry.solids import Solid
from .terrain import triangulate

HIPPED = {"hipped", "half-hipped", "mansard", "side_hipped", "side_half-hipped"}
RIDGED = {"gabled", "gambrel", "saltbox", "round", *HIPPED}
POINTED = {"pyramidal", "dome", "cone", "conical", "onion", "round_gabled"}
SLOPED = {"skillion", "shed", "lean_to", *POINTED}
"""Values of ``roof:shape`` with a roof that is not flat: a ridge, a point, or one slope."""
_GRID = 1e-6  # metres that corners snap to


@dataclass(frozen=True)
class Roof:
    """Shape and size of a roof.

    Parameters
    ----------
    shape : str
        A value of ``roof:shape``. Shapes of a family share one solid: a ridge between two slopes, four slopes, a
        point, one slope.
    height : float, metres
        Height from the eaves to the ridge.
    heading : float or None, radians
        Downward direction, counter-clockwise from east; None for square to the longer side.
    across : bool
        Whether the ridge lies across the longer side instead of along it.
    """

    shape: str = "flat"
    height: float = 0.0
    heading: float | None = None
    across: bool = False


FLAT = Roof()


def house(outline: shapely.Polygon, base: float, eaves: float, *, side: str, roof: Roof = FLAT) -> Solid:
    """Return a building as a closed solid.

    Parameters
    ----------
    outline : Polygon
        Outline in plan, local axes; courtyards are its holes.
    base, eaves : float, metres
        Height of the floor and of the top of the walls.
    side : str
        Material of the walls.
    """
    outline = shapely.set_precision(shapely.remove_repeated_points(outline), _GRID)
    rise = _Rise(outline, roof)
    triangles = np.concatenate([triangulate(piece, least=0.0) for piece in rise.pieces])
    corners, index = np.unique(triangles.reshape(-1, 2), axis=0, return_inverse=True)
    index = index.reshape(-1, 3)
    count = len(corners)
    top = np.column_stack([corners, eaves + rise.height(corners)])
    floor = np.column_stack([corners, np.full(count, base)])
    # Edges between two triangles occur once in each direction. Those without the opposite one are the outline and its
    # courtyards, where walls stand; all triangles are counter-clockwise, so that walls face outwards.
    edges = Counter((int(a), int(b)) for face in index for a, b in zip(face, np.roll(face, -1), strict=True))
    around = [(a, b) for a, b in edges if (b, a) not in edges]
    walls = [(count + a, count + b, b, a) for a, b in around]
    caps = [tuple(map(int, face)) for face in index]
    floors = [tuple(count + corner for corner in reversed(face)) for face in caps]
    faces = (*walls, *caps, *floors)
    materials = (*([side] * len(walls)), *(["roof"] * len(caps)), *([side] * len(floors)))
    return Solid(np.concatenate([top, floor]), faces, materials)


class _Rise:
    """Height of a roof above the eaves, and the pieces of the outline over which it is plane."""

    def __init__(self, outline: shapely.Polygon, roof: Roof) -> None:
        self._roof, self._most = roof.shape, roof.height if roof.shape in RIDGED | SLOPED else 0.0
        self.pieces = [outline]
        if self._most <= 0.0:
            return
        box = shapely.get_coordinates(shapely.minimum_rotated_rectangle(outline))[:4]
        sides = np.diff(box[:3], axis=0)
        longer = sides[int(np.argmax(np.hypot(*sides.T)))]
        along = longer / np.hypot(*longer)
        if roof.heading is not None:
            along = np.array([np.sin(roof.heading), -np.cos(roof.heading)])
        elif roof.across:
            along = np.array([-along[1], along[0]])
        self._along, self._aside = along, np.array([-along[1], along[0]])
        corners = shapely.get_coordinates(outline)
        u, v = corners @ self._along, corners @ self._aside
        self._u, self._v = (u.min() + u.max()) / 2, (v.min() + v.max()) / 2
        self._half_u, self._half_v = (u.max() - u.min()) / 2, (v.max() - v.min()) / 2
        self.pieces = self._cut(outline)

    def height(self, xy: Float) -> Float:
        """Return the height of the roof above the eaves at points (n, 2), metres."""
        if self._most <= 0.0:
            return np.zeros(len(xy))
        u, v = xy @ self._along - self._u, xy @ self._aside - self._v
        # u runs along the ridge and v across it, from the middle of the outline. Every slope is linear in one of them,
        # and the roof is the lowest of its slopes. At the ends hipped roofs are as steep as at the sides.
        slopes = 1.0 - np.abs(v) / self._half_v
        if self._roof in POINTED:
            share = np.minimum(slopes, 1.0 - np.abs(u) / self._half_u)
        elif self._roof in HIPPED:
            share = np.minimum(slopes, (self._half_u - np.abs(u)) / min(self._half_u, self._half_v))
        elif self._roof in RIDGED:
            share = slopes
        else:
            share = (1.0 - v / self._half_v) / 2
        rise: Float = self._most * np.clip(share, 0.0, 1.0)
        return rise

    def _cut(self, outline: shapely.Polygon) -> list[shapely.Polygon]:
        """Return the outline cut along the ridge and the hips of the roof."""
        half_u, half_v = self._half_u, self._half_v
        if self._roof in POINTED:
            lines = [((-half_u, -half_v), (half_u, half_v)), ((-half_u, half_v), (half_u, -half_v))]
        elif self._roof in HIPPED:
            ridge = max(half_u - half_v, 0.0)
            reach = min(half_u, half_v)
            lines = [((-ridge, 0.0), (ridge, 0.0))] if ridge > 0 else []
            lines += [
                ((sign * ridge, 0.0), (sign * (ridge + reach), side * reach)) for sign in (-1, 1) for side in (-1, 1)
            ]
        elif self._roof in RIDGED:
            lines = [((-half_u, 0.0), (half_u, 0.0))]
        else:
            return [outline]
        origin = self._u * self._along + self._v * self._aside
        # Slightly longer than the outline, so that the lines cross it in spite of rounding. If the cells do not add up
        # to the outline, the cut has failed: keep the outline whole.
        edges = [
            shapely.LineString([origin + 1.001 * x * self._along + 1.001 * y * self._aside for x, y in line])
            for line in lines
        ]
        net = shapely.set_precision(shapely.union_all([outline.boundary, *edges]), _GRID)
        cells = shapely.get_parts(shapely.polygonize([shapely.node(net)]))
        inside = [cell for cell in cells if outline.contains(cell.representative_point())]
        whole = sum(cell.area for cell in inside)
        return inside if abs(whole - outline.area) < 1e-3 * outline.area else [outline]
