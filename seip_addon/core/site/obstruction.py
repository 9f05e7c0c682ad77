"""Obstruction of posts and sensors by objects around or near them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from ..arrays import Boolean, Float
from ..geometry.winding_number import enclosed
from .scene_geometry import Mesh, SceneGeometry, joined

_POST_FOOT = 0.3
"""Metres above the ground from which a post must keep clear: kerbs and plinths are no walls."""

_MIN_OBSTACLE_HEIGHT, _MIN_OBSTACLE_WIDTH = 1.0, 0.5
"""Metres of height and of width up to which an object hides next to nothing from a sensor on a post."""

NO_OBSTACLES_MESSAGE = (
    "nothing in this scene can hide anything: it has no building, tree or wall, so that coverage says where the rings "
    "of the sensors fall, not what they can see; describe or model what stands there"
)


def bareness_warnings(geometry: SceneGeometry) -> tuple[str, ...]:
    """Return a warning where no occluder but poles is large enough to hide anything."""
    poles = {pole.name for pole in geometry.poles}
    others = (mesh.triangles.reshape(-1, 3) for mesh in geometry.occluders if mesh.name not in poles)
    return () if any(map(can_hide, others)) else (NO_OBSTACLES_MESSAGE,)


def can_hide(corners: Float) -> bool:
    """Return whether an object with corners (n, 3) is large enough to hide a place from a sensor on a post."""
    if not len(corners):
        return False
    x, y, z = np.ptp(corners, axis=0)
    return bool(z > _MIN_OBSTACLE_HEIGHT and max(x, y) > _MIN_OBSTACLE_WIDTH)


def inside_any(points: Float, meshes: Sequence[Mesh]) -> Boolean:
    """Whether each point lies inside some object, by its winding number."""
    inside = np.zeros(len(points), dtype=bool)
    for mesh in meshes:
        if not len(mesh.triangles):
            continue
        low, high = mesh.triangles.min(axis=(0, 1)), mesh.triangles.max(axis=(0, 1))
        near = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1) & ~inside)
        inside[near] = enclosed(points[near], mesh.triangles)
    return inside


def post_blocked(foot: Float, height: Float, clearance: float, meshes: Sequence[Mesh]) -> Boolean:
    """Whether a post with its sensor comes closer than ``clearance`` to an object.

    A triangle counts when it is that close in plan and its span of heights
    meets the post's: on the safe side for leaning faces.
    """
    blocked = np.zeros(len(foot), dtype=bool)
    triangles = joined(meshes)
    if not len(foot) or not len(triangles):
        return blocked
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    posts = shapely.STRtree(shapely.points(foot[:, :2]))
    boxes = shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    near = np.unique(posts.query(boxes, predicate="dwithin", distance=clearance)[0])
    shadows = shapely.convex_hull(shapely.multipoints(shapely.points(triangles[near, :, :2])))
    shadow, post = posts.query(shadows, predicate="dwithin", distance=clearance)
    triangle = near[shadow]
    below = low[triangle, 2] < foot[post, 2] + height[post] + clearance
    blocked[post[below & (high[triangle, 2] > foot[post, 2] + _POST_FOOT)]] = True
    return blocked
