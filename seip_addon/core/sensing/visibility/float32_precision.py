"""Warnings for scenes in which float32 is too coarse.

Blender stores coordinates in float32, whose steps grow with the distance from the scene's origin. Ray casters use
float32 coordinates relative to the centre of all triangles, so that their steps grow with the scene's extent. The error
of a hit is up to a few such steps across the surface. Along the ray it is larger by one over the cosine of incidence:
thirty times on a road that is met at two degrees.
"""

from __future__ import annotations

import numpy as np

from ...base.arrays import Float
from ...site.scene_geometry import Mesh, SceneGeometry

MAX_STEP = 1e-3
"""Metres; larger steps move returns at grazing incidence by more than a sensor's own noise of 2 to 3 cm."""

FLOAT32_STEP = float(np.finfo(np.float32).eps)
"""Largest step of float32 as a share of a coordinate."""


def rounding_warnings(geometry: SceneGeometry) -> tuple[str, ...]:
    """Return warnings for a scene that is too far from its origin or too wide for float32.

    Parameters
    ----------
    geometry : SceneGeometry
        Geometry in the scene's own coordinates.

    Returns
    -------
    tuple of str
        Warnings; that on the width names the mesh farthest from the origin.
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
            f"{FLOAT32_STEP * reach * 1e3:.2g} mm: move it to the origin, and enter the offset in seip_origin"
        )
        return tuple(warnings)
    extent = float(np.ptp(np.concatenate([_bounds(mesh) for mesh in meshes]), axis=0).max())
    if extent * FLOAT32_STEP > MAX_STEP:
        warnings.append(
            f"the scene is {extent:,.0f} m wide: ray hits are rounded to {FLOAT32_STEP * extent * 1e3:.2g} mm, and to "
            f"many times that on a distant road; remove {farthest.name!r}, which lies {reach:,.0f} m out, if it is "
            "not needed"
        )
    return tuple(warnings)


def _nearest(mesh: Mesh) -> float:
    """Return the largest coordinate of the mesh's corner that is nearest to the origin."""
    return float(np.abs(mesh.triangles).max(axis=2).min())


def _bounds(mesh: Mesh) -> Float:
    points = mesh.triangles.reshape(-1, 3)
    return np.stack([points.min(axis=0), points.max(axis=0)])
