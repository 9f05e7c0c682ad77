"""What keeps a sensor or its post from standing somewhere: objects around it or too near."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from .arrays import Boolean, Float
from .scene_geometry import Mesh, joined
from .winding import enclosed

_POST_FOOT = 0.3
"""Metres above the ground from which a post must keep clear: kerbs and plinths are no walls."""


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
