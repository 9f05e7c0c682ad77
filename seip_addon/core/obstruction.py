"""What keeps a sensor or its post from standing somewhere: objects around it or too near."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from .arrays import Boolean, Float
from .scene_geometry import Mesh, joined

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
        inside[near] = np.abs(winding_number(points[near], mesh.triangles)) > 0.5
    return inside


def winding_number(points: Float, triangles: Float) -> Float:
    """Generalised winding number of a triangle soup: 1 (or −1) inside, 0 outside, between where it is open.

    Parameters
    ----------
    points : (n, 3) float64, metres
    triangles : (m, 3, 3) float64, metres

    Returns
    -------
    (n,) float64

    Notes
    -----
    Where shells of opposite sense lie within each other, or faces are turned at
    random, their parts cancel and a point inside counts as outside. That does no
    harm here: a sensor that closed faces surround sees nothing.

    Solid angle of a triangle after van Oosterom and Strackee (1983); as a test
    for open and messy meshes Jacobson et al. (2013).
    """
    total = np.zeros(len(points))
    for row, point in enumerate(points):
        a, b, c = np.moveaxis(triangles - point, 1, 0)
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c))
        dots = (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb
        total[row] = np.arctan2(volume, la * lb * lc + dots).sum() / (2 * np.pi)
    return total


def post_blocked(foot: Float, height: Float, clearance: float, meshes: Sequence[Mesh]) -> Boolean:
    """Whether a post with its sensor comes closer than ``clearance`` to an object.

    A triangle counts when it is that close in plan and its span of heights
    meets the post's: on the safe side for leaning faces.
    """
    blocked = np.zeros(len(foot), dtype=bool)
    triangles = joined(meshes)
    if not len(foot) or not len(triangles):
        return blocked
    low, high = triangles[:, :, 2].min(axis=1), triangles[:, :, 2].max(axis=1)
    corners = shapely.points(triangles[:, :, :2])
    tree = shapely.STRtree(shapely.convex_hull(shapely.multipoints(corners)))
    post, triangle = tree.query(shapely.points(foot[:, :2]), predicate="dwithin", distance=clearance)
    meets = (low[triangle] < foot[post, 2] + height[post] + clearance) & (high[triangle] > foot[post, 2] + _POST_FOOT)
    blocked[post[meets]] = True
    return blocked
