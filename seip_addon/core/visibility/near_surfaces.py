"""At which heights something stands within δ of a target.

A return within δ of a target lies on a triangle that meets the ball of radius δ
about it. The triangle's plane, at the signed distance h from the target, cuts a
disc of radius ρ = √(δ² − h²) out of the ball, whose height reaches ρ·√(1 − n_z²)
up and down from its centre, n being the unit normal. On a road that is a slab a
few centimetres thick, instead of a ball: what makes rays that pass over a target
drop out of the reckoning. All this depends on neither pose nor sensor.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
import shapely

from ..arrays import Float, Integer

_TARGETS_AT_ONCE = 2048  # bounds the memory of the pairs of targets and triangles

_LEAST_TOLERANCE = 1e-3  # metres
_FLOAT32_ROUNDINGS = 64


@dataclass(frozen=True, eq=False)
class Discs:
    """Circles about what balls of radius δ about targets cut out of the triangles that they meet.

    Parameters
    ----------
    target : (k,) int64
        Ascending.
    centre : (k, 3) float64, metres
        On the triangle's plane.
    normal : (k, 3) float64
        Unit normals.
    radius : (k,) float64, metres
        In plan.
    low, high : (k,) float64, metres
        Heights between which the triangle and the disc both lie.
    """

    target: Integer
    centre: Float
    normal: Float
    radius: Float
    low: Float
    high: Float


@dataclass(frozen=True, eq=False)
class NearSurfaces:
    """Where returns within δ of targets can lie.

    Parameters
    ----------
    xyz : (t, 3) float64, metres
        The targets.
    low, high : (t,) float64, metres
        Heights between which surfaces lie within δ; low > high where there is none.
    radius : float, metres
        δ and the tolerance: such returns are nearer than this in plan.
    discs : Discs
        The surfaces one by one.
    tolerance : float, metres
        How far a ray caster's returns may lie off the surfaces. It is in all heights and radii.
    """

    xyz: Float
    low: Float
    high: Float
    radius: float
    discs: Discs
    tolerance: float


def near_surfaces(triangles: Float, targets: Float, delta: float) -> NearSurfaces:
    """Find the surfaces near targets.

    Parameters
    ----------
    triangles : (n, 3, 3) float64, metres
    targets : (t, 3) float64, metres
    delta : float, metres

    Returns
    -------
    NearSurfaces
    """
    tolerance = caster_tolerance(triangles)
    radius = delta + tolerance
    in_plan = shapely.STRtree(shapely.box(*triangles[:, :, :2].min(axis=1).T, *triangles[:, :, :2].max(axis=1).T))
    parts = []
    for begin in range(0, len(targets), _TARGETS_AT_ONCE):
        xy = targets[begin : begin + _TARGETS_AT_ONCE, :2]
        near, triangle = in_plan.query(shapely.box(*(xy - radius).T, *(xy + radius).T))
        order = np.argsort(near, kind="stable")
        target = near[order] + begin
        parts.append(_cut(triangles[triangle[order]], targets[target], target, radius))
    discs = Discs(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Discs)))
    discs = replace(discs, low=discs.low - tolerance, high=discs.high + tolerance)
    low, high = np.full(len(targets), np.inf), np.full(len(targets), -np.inf)
    np.minimum.at(low, discs.target, discs.low)
    np.maximum.at(high, discs.target, discs.high)
    return NearSurfaces(targets, low, high, radius, discs, tolerance)


def caster_tolerance(triangles: Float) -> float:
    """Return how far a float32 ray caster's returns may lie off the triangles, in metres, generously."""
    if len(triangles) == 0:
        return _LEAST_TOLERANCE
    points = triangles.reshape(-1, 3)
    extent = float((points.max(axis=0) - points.min(axis=0)).max())
    return max(_LEAST_TOLERANCE, _FLOAT32_ROUNDINGS * float(np.finfo(np.float32).eps) * extent)


def _cut(corners: Float, centre: Float, target: Integer, ball: float) -> Discs:
    """Cut triangles with balls, pair by pair. Pairs that just miss each other near a corner may be among the discs."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    normal /= np.where(length > 0, length, 1.0)[:, None]
    above = ((centre - corners[:, 0]) * normal).sum(axis=1)
    disc = np.sqrt(np.maximum(ball**2 - above**2, 0.0))
    meets = (length > 0) & (np.abs(above) < ball)
    for side in range(3):
        edge = corners[:, (side + 1) % 3] - corners[:, side]
        outward = np.cross(edge, normal)
        meets &= ((centre - corners[:, side]) * outward).sum(axis=1) <= disc * np.linalg.norm(edge, axis=1)
    middle = centre - above[:, None] * normal
    half = disc * np.sqrt(np.maximum(1 - normal[:, 2] ** 2, 0.0))
    low = np.maximum(middle[:, 2] - half, corners[:, :, 2].min(axis=1))
    high = np.minimum(middle[:, 2] + half, corners[:, :, 2].max(axis=1))
    meets &= low <= high
    # In plan a small or steep triangle lies in a circle about its centroid that is narrower than the disc.
    centroid = corners.mean(axis=1)
    reach = np.linalg.norm((corners - centroid[:, None])[:, :, :2], axis=2).max(axis=1)
    middle = np.where((reach < disc)[:, None], centroid, middle)
    radius = np.minimum(reach, disc)
    return Discs(target[meets], middle[meets], normal[meets], radius[meets], low[meets], high[meets])
