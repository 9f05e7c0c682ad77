"""Polygons in space as triangles of solids."""

import itertools
from collections.abc import Iterator

import numpy as np
import shapely

from ...arrays import Float, Integer
from ...geometry.solids import Solid
from .cityjson import CityModel, ModelledBuilding, Surface

MIN_AREA = 1e-4  # square metres: smaller surfaces are ignored
STEEP = 0.3  # vertical component of a normal above which a surface without a kind is a roof


def building_solid(model: CityModel, building: ModelledBuilding, side: str) -> Solid | None:
    """Return a building as a solid of triangles; None if no surface has an area.

    Parameters
    ----------
    side : str
        Material of its walls.

    Returns
    -------
    Solid or None
        Solid in the coordinates of the model, with shared corners.
    """
    triangles, materials = [], []
    for surface in building.surfaces:
        for found, normal in _triangles(model.vertices, surface):
            triangles.append(found)
            is_roof = surface.kind == "RoofSurface" or (not surface.kind and normal[2] > STEEP)
            materials += ["roof" if is_roof else side] * len(found)
    if not triangles:
        return None
    used, index = np.unique(np.concatenate(triangles), return_inverse=True)
    faces = tuple(map(tuple, index.reshape(-1, 3).tolist()))
    return Solid(model.vertices[used], faces, tuple(materials))


def _triangles(vertices: Float, surface: Surface) -> Iterator[tuple[Integer, Float]]:
    """Yield vertex indices of triangles (n, 3) and the normal (3,) of a surface; none if it has no area."""
    rings = [_without_repeats(ring) for ring in surface.rings]
    if not rings or len(rings[0]) < 3:
        return
    rings = [ring for ring in rings if len(ring) >= 3]
    # Newell's method: the sum of cross products of successive corners is twice the vector area, also for outlines that
    # are not quite planar or not convex.
    corners = vertices[rings[0]] - vertices[rings[0][0]]
    area = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0) / 2
    size = float(np.linalg.norm(area))
    if size < MIN_AREA:
        return
    normal = area / size
    if len(rings) == 1 and len(rings[0]) == 3:
        yield rings[0][None], normal
        return
    # Two axes in the plane of the surface, from the coordinate axis least parallel to the normal; `plane` has the
    # orientation of the surface, so that counter-clockwise triangles face outwards.
    across = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    across /= np.linalg.norm(across)
    plane = np.column_stack([across, np.cross(normal, across)])
    indices = np.concatenate(rings)
    flat = (vertices[indices] - vertices[rings[0][0]]) @ plane
    bounds = np.cumsum([0, *map(len, rings)])
    outlines = [flat[low:high] for low, high in itertools.pairwise(bounds)]
    polygon = shapely.Polygon(outlines[0], outlines[1:])
    if not polygon.is_valid:
        polygon = shapely.make_valid(polygon, method="structure")
    areas = [part for part in shapely.get_parts(polygon) if part.geom_type == "Polygon"]
    pieces = shapely.get_parts(shapely.constrained_delaunay_triangles(areas))
    if not len(pieces):
        return
    places = shapely.get_coordinates(pieces).reshape(-1, 4, 2)[:, :3]
    along, aside = places[:, 1] - places[:, 0], places[:, 2] - places[:, 0]
    turn = along[:, 0] * aside[:, 1] - along[:, 1] * aside[:, 0]
    places[turn < 0] = places[turn < 0, ::-1]
    # Where an outline crosses itself, the crossing is replaced by the nearest corner.
    # Triangles come back as coordinates: find the vertex of each corner, so that heights are those of the file.
    nearest = shapely.STRtree(shapely.points(flat)).nearest(shapely.points(places.reshape(-1, 2)))
    found = indices[nearest].reshape(-1, 3)
    distinct = (found[:, 0] != found[:, 1]) & (found[:, 1] != found[:, 2]) & (found[:, 0] != found[:, 2])
    kept = found[distinct & (np.abs(turn) / 2 > MIN_AREA**2)]
    if len(kept):
        yield kept, normal


def _without_repeats(ring: Integer) -> Integer:
    kept: Integer = ring[ring != np.roll(ring, 1)]
    return kept
