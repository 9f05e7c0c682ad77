"""Removal of geometry beyond every sensor's range of the region.

Ray casters compute in float32 relative to the centre of all triangles, and the resolution of float32 decreases with the
extent: a single distant object makes every return less accurate, and the search for near surfaces slower.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from ..base.arrays import Boolean, Float
from ..base.counts import counted
from .scene_geometry import Mesh, SceneGeometry

_RANGE_SLACK = 1.0
"""Metres kept beyond the range, because returns have errors."""


def without_far_objects(
    geometry: SceneGeometry, around: BaseGeometry, reach: float
) -> tuple[SceneGeometry, tuple[str, ...]]:
    """Remove the triangles that no ray can reach.

    Parameters
    ----------
    around : shapely geometry
        Area in plan in which every relevant ray begins or ends: the region of interest, or the sensors.
    reach : float, metres
        Length of the longest such ray.

    Returns
    -------
    geometry : SceneGeometry
        Geometry without distant triangles; the same object if there are none.
    warnings : tuple of str
        A sentence that names the objects left out, if any; those that the builder of sites made are not reported.
    """
    if math.isinf(reach):
        return geometry, ()
    middle = around.convex_hull
    roles = {name: getattr(geometry, name) for name in ("roads", "ground", "occluders")}
    kept = {name: [_near(mesh, middle, reach) for mesh in meshes] for name, meshes in roles.items()}
    if all(near.all() for each in kept.values() for near in each):
        return geometry, ()
    left: dict[str, Any] = {
        name: tuple(_part(mesh, near) for mesh, near in zip(meshes, kept[name], strict=True) if near.any())
        for name, meshes in roles.items()
    }
    far = [
        (mesh.name, mesh.triangles[~near])
        for name, meshes in roles.items()
        for mesh, near in zip(meshes, kept[name], strict=True)
        if not near.all() and not mesh.source
    ]
    if not far:
        return replace(geometry, **left), ()
    distances = [float(shapely.distance(middle, _plan_boxes(triangles)).max()) for _, triangles in far]
    farthest = int(np.argmax(distances))
    count = sum(len(triangles) for _, triangles in far)
    triangles = f"{counted(count, 'triangle')} of {counted(len(far), 'object')} {'lies' if count == 1 else 'lie'}"
    sentence = (
        f"{triangles} beyond every sensor's range of {reach:,.0f} m and {'is' if count == 1 else 'are'} left "
        f"out; the farthest, of {far[farthest][0]!r}, are {distances[farthest]:,.0f} m away: "
        "move or remove them if they do not belong there"
    )
    return replace(geometry, **left), (sentence,)


def _near(mesh: Mesh, middle: BaseGeometry, reach: float) -> Boolean:
    """Return which triangles of a mesh are within reach in plan, (n,) bool."""
    near: Boolean = shapely.dwithin(middle, _plan_boxes(mesh.triangles), reach + _RANGE_SLACK)
    return near


def _plan_boxes(triangles: Float) -> NDArray[np.object_]:
    plan = triangles[:, :, :2]
    boxes: NDArray[np.object_] = shapely.box(*plan.min(axis=1).T, *plan.max(axis=1).T)
    return boxes


def _part(mesh: Mesh, which: Boolean) -> Mesh:
    reflectivity = None if mesh.reflectivity is None else mesh.reflectivity[which]
    return mesh if which.all() else replace(mesh, triangles=mesh.triangles[which], reflectivity=reflectivity)
