"""Polygons in space as triangles of solids."""

import itertools
from collections.abc import Iterator

import numpy as np
import shapely

from ...arrays import Float, Integer
from ...geometry.solids import Solid
from .cityjson import CityModel, ModelledBuilding, Surface

MIN_AREA = 1e-4  # square metres below which a surface, or a triangle of it, shows nothing
STEEP = 0.3  # upward share of a normal from which on a surface that is not named is a roof


def building_solid(model: CityModel, building: ModelledBuilding, side: str) -> Solid | None:
    """Return a building as a solid of triangles; None where no surface has an area.

    Parameters
    ----------
    side : str
        Material of its walls.

    Returns
    -------
    Solid
        In the coordinates of the model, corners shared.
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
    """Yield triangles (n, 3) of indices and the normal (3,) of a surface, nothing where it has no area."""
    rings = [_without_repeats(ring) for ring in surface.rings]
    if not rings or len(rings[0]) < 3:
        return
    rings = [ring for ring in rings if len(ring) >= 3]
    corners = vertices[rings[0]] - vertices[rings[0][0]]
    area = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0) / 2
    size = float(np.linalg.norm(area))
    if size < MIN_AREA:
        return
    normal = area / size
    if len(rings) == 1 and len(rings[0]) == 3:
        yield rings[0][None], normal
        return
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
    # Where an outline crosses itself the corner nearest to the crossing stands for it.
    nearest = shapely.STRtree(shapely.points(flat)).nearest(shapely.points(places.reshape(-1, 2)))
    found = indices[nearest].reshape(-1, 3)
    distinct = (found[:, 0] != found[:, 1]) & (found[:, 1] != found[:, 2]) & (found[:, 0] != found[:, 2])
    kept = found[distinct & (np.abs(turn) / 2 > MIN_AREA**2)]
    if len(kept):
        yield kept, normal


def _without_repeats(ring: Integer) -> Integer:
    kept: Integer = ring[ring != np.roll(ring, 1)]
    return kept
