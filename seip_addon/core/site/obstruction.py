"""Obstruction of posts and sensors by objects around them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..base.arrays import Boolean, Float
from ..geometry.winding_number import enclosed
from .scene_geometry import Mesh, SceneGeometry, joined

_POST_FOOT = 0.3
"""Metres above the ground above which a post must be clear of objects: kerbs and plinths do not obstruct it."""

_MIN_OBSTACLE_HEIGHT, _MIN_OBSTACLE_WIDTH = 1.0, 0.5
"""Height and width (metres) up to which an object hides almost no area from a sensor on a post."""

NO_OBSTACLES_MESSAGE = (
    "nothing in this scene can hide anything: no building, tree or wall stands between sensors and road, so that "
    "coverage shows where the rings of the sensors fall, not what they can see; describe or model the objects there"
)


def bareness_warnings(geometry: SceneGeometry, places: Float | None = None) -> tuple[str, ...]:
    """Return a warning if no occluder except poles has a size and a position to hide anything.

    Parameters
    ----------
    geometry : SceneGeometry
        Scene to check.
    places : (n, 2) float64, metres, optional
        Positions of sensors and targets in plan: only objects between them are considered.
    """
    poles = {pole.name for pole in geometry.poles}
    others = [mesh.triangles for mesh in geometry.occluders if mesh.name not in poles]
    if places is not None:
        area = shapely.multipoints(places).convex_hull
        others = [triangles for triangles in others if _reaches_into(triangles, area)]
    hides = any(can_hide(triangles.reshape(-1, 3)) for triangles in others)
    return () if hides else (NO_OBSTACLES_MESSAGE,)


def _reaches_into(triangles: Float, area: BaseGeometry) -> bool:
    """Return whether a triangle (n, 3, 3) of an object lies at least partly in an area in plan."""
    return bool(shapely.intersects(area, shapely.convex_hull(shapely.multipoints(triangles[:, :, :2]))).any())


def can_hide(corners: Float) -> bool:
    """Return whether an object with corners (n, 3) is large enough to hide a place from a sensor on a post."""
    if not len(corners):
        return False
    x, y, z = np.ptp(corners, axis=0)
    return bool(z > _MIN_OBSTACLE_HEIGHT and max(x, y) > _MIN_OBSTACLE_WIDTH)


def inside_any(points: Float, meshes: Sequence[Mesh]) -> Boolean:
    """Return whether each point lies inside an object, by its winding number."""
    inside = np.zeros(len(points), dtype=bool)
    for mesh in meshes:
        if not len(mesh.triangles):
            continue
        low, high = mesh.triangles.min(axis=(0, 1)), mesh.triangles.max(axis=(0, 1))
        near = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1) & ~inside)
        inside[near] = enclosed(points[near], mesh.triangles)
    return inside


def post_blocked(foot: Float, height: Float, clearance: float, meshes: Sequence[Mesh]) -> Boolean:
    """Return whether a post with its sensor is closer than ``clearance`` to an object.

    A triangle obstructs a post if it is that close in plan and its range of heights overlaps that of the post, which is
    on the safe side for inclined faces.
    """
    blocked = np.zeros(len(foot), dtype=bool)
    triangles = joined(meshes)
    if not len(foot) or not len(triangles):
        return blocked
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    posts = shapely.STRtree(shapely.points(foot[:, :2]))
    boxes = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    # Bounding boxes first: convex hulls are only made of the few triangles near a post.
    near = np.unique(posts.query(boxes, predicate="dwithin", distance=clearance)[0])
    shadows = shapely.convex_hull(shapely.multipoints(shapely.points(triangles[near, :, :2])))
    shadow, post = posts.query(shadows, predicate="dwithin", distance=clearance)
    triangle = near[shadow]
    below = low[triangle, 2] < foot[post, 2] + height[post] + clearance
    blocked[post[below & (high[triangle, 2] > foot[post, 2] + _POST_FOOT)]] = True
    return blocked
