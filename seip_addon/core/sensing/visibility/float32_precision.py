"""Warnings where float32 is too coarse for a scene.

Blender keeps coordinates in float32, whose steps grow with the distance from the
scene's origin; ray casters take float32 coordinates about the middle of all that
they are given, so that there the steps grow with the scene's extent. A hit is off by
up to some such step across the surface, and by that over the cosine of incidence
along the ray: thirty times as much on a road that is met at two degrees.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Float
from ...site.scene_geometry import Mesh, SceneGeometry

MAX_STEP = 1e-3
"""Metres: coarser steps move returns at a grazing incidence by as much as a sensor's own noise of 2 to 3 cm."""

FLOAT32_STEP = float(np.finfo(np.float32).eps)
"""Largest step of float32 as a share of a coordinate."""


def rounding_warnings(geometry: SceneGeometry) -> tuple[str, ...]:
    """Return warnings where a scene is too far from its origin or too wide for float32.

    Parameters
    ----------
    geometry : SceneGeometry
        As it was read: in the scene's own coordinates.

    Returns
    -------
    tuple of str
        One sentence each, naming the mesh that lies farthest out.
    """
    meshes = [mesh for mesh in (*geometry.roads, *geometry.ground, *geometry.occluders) if len(mesh.triangles)]
    if not meshes:
        return ()
    warnings = []
    farthest = max(meshes, key=lambda mesh: float(np.abs(mesh.triangles).max()))
    reach = float(np.abs(farthest.triangles).max())
    if all(_nearest(mesh) * FLOAT32_STEP > MAX_STEP for mesh in meshes):
        warnings.append(
            f"the scene lies {reach:,.0f} m from its origin, where Blender keeps coordinates in steps of "
            f"{FLOAT32_STEP * reach * 1e3:.2g} mm: move it to the origin, and note the way in the scene's seip_origin"
        )
        return tuple(warnings)
    extent = float(np.ptp(np.concatenate([_bounds(mesh) for mesh in meshes]), axis=0).max())
    if extent * FLOAT32_STEP > MAX_STEP:
        warnings.append(
            f"the scene is {extent:,.0f} m wide: rays end in steps of {FLOAT32_STEP * extent * 1e3:.2g} mm, many "
            f"times that on a road at a distance; take {farthest.name!r}, which lies {reach:,.0f} m out, "
            "away if it is not needed"
        )
    return tuple(warnings)


def _nearest(mesh: Mesh) -> float:
    """Largest coordinate of the mesh's corner that is nearest to the origin."""
    return float(np.abs(mesh.triangles).max(axis=2).min())


def _bounds(mesh: Mesh) -> Float:
    points = mesh.triangles.reshape(-1, 3)
    return np.stack([points.min(axis=0), points.max(axis=0)])
