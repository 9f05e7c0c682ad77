"""Scene of a network: the streets of an extract in plan, and an object for each junction."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
import shapely

from ..core.arrays import Float
from ..core.output.pictures.palette import MAP_STREETS
from ..core.world.openstreetmap.street_plan import StreetPlan
from . import contract
from .materials import linear

STREET_WIDTHS, DOT_SIZES = (3.0, 6.0, 10.0), (1.0, 1.3, 1.6)
"""Metres, and factors of `_dot_radius`, by importance of the street or junction."""
SMALLEST_DOT, LARGEST_DOT = 8.0, 30.0
"""Radii, metres."""
RISE = 0.2
"""Metres between streets of one importance and the next, so that the more important ones are drawn above."""
CORNERS = 24
"""Of the polygon that stands for a dot."""


def build_network(scene: bpy.types.Scene, names: Sequence[str], plan: StreetPlan) -> None:
    """Fill a scene with the streets and junctions of an extract.

    Parameters
    ----------
    scene : bpy.types.Scene
        Receives them in the collection `contract.NETWORK`.
    names : sequence of str
        Names of the junctions, in the order of the plan.
    plan : StreetPlan
    """
    collection = contract.find_or_make(scene, contract.NETWORK)
    for importance, width in enumerate(STREET_WIDTHS):
        lines = [one.line for one in plan.streets if one.importance == importance]
        if lines:
            collection.objects.link(_streets(lines, width, importance))
    radius = _dot_radius(plan.junctions)
    dots = [_dot(radius * size) for size in DOT_SIZES]
    for name, (x, y), importance in zip(names, plan.junctions.tolist(), plan.importance.tolist(), strict=True):
        obj = bpy.data.objects.new(name, dots[importance])
        obj.location = (x, y, RISE * (1 + len(STREET_WIDTHS)))
        obj[contract.JUNCTION] = name
        obj.lock_location = obj.lock_rotation = obj.lock_scale = (True, True, True)
        collection.objects.link(obj)
    scene[contract.ATTRIBUTION] = plan.attribution
    scene.unit_settings.system, scene.unit_settings.scale_length = "METRIC", 1.0


def is_network(scene: bpy.types.Scene) -> bool:
    """Return whether a scene shows a network."""
    return len(junctions(scene)) > 0


def junctions(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Return the objects that stand for the junctions of a network."""
    collection = contract.find(scene, contract.NETWORK)
    return [] if collection is None else [obj for obj in collection.objects if contract.JUNCTION in obj]


def extent(scene: bpy.types.Scene) -> shapely.Geometry:
    """Return the rectangle around the junctions of a network, in plan."""
    return shapely.envelope(shapely.multipoints([obj.location[:2] for obj in junctions(scene)]))


def paint_junction(obj: bpy.types.Object, colour: str) -> None:
    """Give a junction a colour of the palette."""
    obj.color = linear(colour)


def _dot_radius(places: Float) -> float:
    """Return a radius at which most dots do not touch: a sixth of the median distance to the nearest neighbour."""
    if len(places) < 2:
        return SMALLEST_DOT
    tree = shapely.STRtree(shapely.points(places))
    _, distances = tree.query_nearest(shapely.points(places), exclusive=True, return_distance=True, all_matches=False)
    return float(np.clip(np.median(distances) / 6.0, SMALLEST_DOT, LARGEST_DOT))


def _streets(lines: Sequence[Float], width: float, importance: int) -> bpy.types.Object:
    """Return an object with a rectangle for each straight piece of the lines."""
    starts, ends = (np.concatenate([line[part] for line in lines]) for part in (slice(None, -1), slice(1, None)))
    along = ends - starts
    length = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-6)
    side = np.column_stack((-along[:, 1], along[:, 0])) / length * width / 2.0
    corners = np.stack((starts - side, ends - side, ends + side, starts + side), axis=1).reshape(-1, 2)
    points = np.column_stack((corners, np.full(len(corners), RISE * importance)))
    mesh = bpy.data.meshes.new("Streets")
    mesh.from_pydata(points.tolist(), [], np.arange(len(points)).reshape(-1, 4).tolist())
    obj = bpy.data.objects.new("Streets", mesh)
    obj.color = linear(MAP_STREETS[importance])
    obj.hide_select = True  # a click between junctions selects none
    return obj


def _dot(radius: float) -> bpy.types.Mesh:
    angles = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False)
    rim = np.column_stack((radius * np.cos(angles), radius * np.sin(angles), np.zeros(CORNERS)))
    mesh = bpy.data.meshes.new("Junction")
    mesh.from_pydata(rim.tolist(), [], [list(range(CORNERS))])
    return mesh
