"""Removal of geometry beyond every sensor's range of the region.

Ray casters compute in float32 about the middle of all triangles, whose steps grow with the extent: one object
that was forgotten far away costs every return its accuracy, and the search for near surfaces its speed.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from ..arrays import Boolean, Float
from ..counts import counted
from .scene_geometry import Mesh, SceneGeometry

_RANGE_SLACK = 1.0
"""Metres beyond the range that are kept, for all that a return may be off."""


def without_far_objects(
    geometry: SceneGeometry, around: BaseGeometry, reach: float
) -> tuple[SceneGeometry, tuple[str, ...]]:
    """Leave out the triangles that no ray can end on.

    Parameters
    ----------
    around : shapely geometry
        In plan, what every ray that counts begins or ends in: the region of interest, or the sensors.
    reach : float, metres
        Length of the longest such ray.

    Returns
    -------
    geometry : SceneGeometry
        The same object where nothing is left out.
    warnings : tuple of str
        One sentence that names what was left out, or none: ground that the builder laid out, and that goes on beyond
        the range, belongs there.
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
        if not near.all() and not (mesh.source and near.any())
    ]
    if not far:
        return replace(geometry, **left), ()
    distances = [float(shapely.distance(middle, _plan_boxes(triangles)).max()) for _, triangles in far]
    farthest = int(np.argmax(distances))
    count = sum(len(triangles) for _, triangles in far)
    triangles = f"{counted(count, 'triangle')} of {counted(len(far), 'object')} {'lies' if count == 1 else 'lie'}"
    sentence = (
        f"{triangles} beyond every sensor's range of {reach:,.0f} m and {'is' if count == 1 else 'are'} left "
        f"out; the farthest, of {far[farthest][0]!r}, lie {distances[farthest]:,.0f} m away: "
        "where they do not belong there, move them or take them away"
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
