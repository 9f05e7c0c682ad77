"""Surfaces within δ of each target, and the heights that they span.

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

from ...arrays import Boolean, Float, Integer
from ...geometry.orientation import rotated
from ...site.scene_geometry import DEFAULT_REFLECTIVITY

_TARGETS_AT_ONCE = 2048  # bounds the memory of the pairs of targets and triangles

_MIN_TOLERANCE = 1e-3  # metres
_FLOAT32_ROUNDINGS = 64


@dataclass(frozen=True, eq=False)
class Cuts:
    """Discs: intersections of balls of radius δ about targets with the planes of triangles.

    Parameters
    ----------
    target : (k,) int64
        Ascending.
    corners : (k, 3, 3) float64, metres
        Of the triangle.
    normal : (k, 3) float64
        Unit normals.
    middle : (k, 3) float64, metres
        Of the disc.
    radius : (k,) float64, metres
    reflectivity : (k,) float64, 0 to 1
        Of the triangle.
    """

    target: Integer
    corners: Float
    normal: Float
    middle: Float
    radius: Float
    reflectivity: Float

    def pick(self, which: Integer) -> Cuts:
        """Return some of the cuts."""
        return Cuts(*(getattr(self, field.name)[which] for field in fields(self)))

    def holds(self, points: Float, margin: float) -> Boolean:
        """Return which points (k, 3) lie on their triangle, but for a margin in metres; (k,) bool."""
        there: Boolean = np.abs(((points - self.corners[:, 0]) * self.normal).sum(axis=1)) <= margin
        for side in range(3):
            edge = self.corners[:, (side + 1) % 3] - self.corners[:, side]
            outward = np.cross(edge, self.normal)
            there &= ((points - self.corners[:, side]) * outward).sum(axis=1) <= margin * np.linalg.norm(edge, axis=1)
        return there

    def bounds(self, tolerance: float) -> Discs:
        """Bound in plan and in height what lies both in the disc and in the triangle."""
        middle = self.middle
        a, b, c = self.corners[:, 0], self.corners[:, 1], self.corners[:, 2]
        half = self.radius * np.sqrt(np.maximum(1 - self.normal[:, 2] ** 2, 0.0))
        # The tolerance comes before any comparison: on a level face both heights are one but for rounding.
        low = np.maximum(middle[:, 2] - half, np.minimum(np.minimum(a[:, 2], b[:, 2]), c[:, 2])) - tolerance
        high = np.minimum(middle[:, 2] + half, np.maximum(np.maximum(a[:, 2], b[:, 2]), c[:, 2])) + tolerance
        # In plan a small or steep triangle lies in a circle about its centroid that is narrower than the disc.
        centroid = (a + b + c) / 3
        x, y = ((self.corners - centroid[:, None])[:, :, axis] for axis in (0, 1))
        apart = x * x + y * y
        reach = np.sqrt(np.maximum(np.maximum(apart[:, 0], apart[:, 1]), apart[:, 2]))
        centre = np.where((reach < self.radius)[:, None], centroid, middle)
        radius = np.minimum(reach, self.radius)
        both = low <= high
        return Discs(
            target=self.target[both],
            centre=centre[both],
            normal=self.normal[both],
            radius=radius[both],
            low=low[both],
            high=high[both],
            reflectivity=self.reflectivity[both],
            cuts=self,
        )


@dataclass(frozen=True, eq=False)
class Discs:
    """Circles about the intersections of balls of radius δ about targets with triangles.

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
    reflectivity : (k,) float64, 0 to 1
    cuts : Cuts
        What they are about.
    """

    target: Integer
    centre: Float
    normal: Float
    radius: Float
    low: Float
    high: Float
    reflectivity: Float
    cuts: Cuts


@dataclass(frozen=True, eq=False)
class NearSurfaces:
    """Surfaces on which returns within δ of targets can lie.

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


def near_surfaces(
    triangles: Float, targets: Float, delta: float, reflectivity: Float | float = DEFAULT_REFLECTIVITY
) -> NearSurfaces:
    """Find the surfaces near targets.

    Parameters
    ----------
    triangles : (n, 3, 3) float64, metres
    targets : (t, 3) float64, metres
    delta : float, metres
    reflectivity : (n,) float64 or float, 0 to 1
        Of the triangles.

    Returns
    -------
    NearSurfaces
    """
    reflects = np.broadcast_to(np.asarray(reflectivity, dtype=np.float64), len(triangles))
    tolerance = caster_tolerance(triangles)
    radius = delta + tolerance
    in_plan = shapely.STRtree(shapely.box(*triangles[:, :, :2].min(axis=1).T, *triangles[:, :, :2].max(axis=1).T))
    parts = []
    for begin in range(0, len(targets), _TARGETS_AT_ONCE):
        xy = targets[begin : begin + _TARGETS_AT_ONCE, :2]
        near, triangle = in_plan.query(shapely.box(*(xy - radius).T, *(xy + radius).T))
        order = np.argsort(near, kind="stable")
        target = near[order] + begin
        parts.append(_cut(triangles[triangle[order]], targets[target], target, radius, reflects[triangle[order]]))
    cuts = Cuts(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Cuts)))
    return _about(targets, radius, cuts.bounds(tolerance), tolerance)


def rotated_surfaces(surfaces: NearSurfaces, origin: Float, orientation: Float) -> NearSurfaces:
    """Return the same surfaces in the axes of a sensor at any position and orientation.

    Parameters
    ----------
    surfaces : NearSurfaces
        In the site's axes.
    origin : (3,) float64, metres
        The sensor's.
    orientation : (3, 3) float64
        Rotation from the sensor's axes to the site's.
    """
    cuts, tolerance = surfaces.discs.cuts, surfaces.tolerance
    turned_cuts = replace(
        cuts,
        # as one list of points: for each triangle by itself the product is many times slower
        corners=((cuts.corners - origin).reshape(-1, 3) @ orientation).reshape(-1, 3, 3),
        normal=cuts.normal @ orientation,
        middle=(cuts.middle - origin) @ orientation,
    )
    targets = rotated(surfaces.xyz - origin, orientation.T)
    return _about(targets, surfaces.radius, turned_cuts.bounds(tolerance), tolerance)


def _about(targets: Float, radius: float, discs: Discs, tolerance: float) -> NearSurfaces:
    """Put discs about their targets."""
    low, high = np.full(len(targets), np.inf), np.full(len(targets), -np.inf)
    np.minimum.at(low, discs.target, discs.low)
    np.maximum.at(high, discs.target, discs.high)
    return NearSurfaces(targets, low, high, radius, discs, tolerance)


def caster_tolerance(triangles: Float) -> float:
    """Return how far a float32 ray caster's returns may lie off the triangles, in metres, generously."""
    if len(triangles) == 0:
        return _MIN_TOLERANCE
    points = triangles.reshape(-1, 3)
    extent = float((points.max(axis=0) - points.min(axis=0)).max())
    return max(_MIN_TOLERANCE, _FLOAT32_ROUNDINGS * float(np.finfo(np.float32).eps) * extent)


def _cut(corners: Float, centre: Float, target: Integer, ball: float, reflectivity: Float) -> Cuts:
    """Cut triangles with balls, pair by pair. Pairs that just miss each other near a corner may be among them."""
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
    return Cuts(*(part[meets] for part in (target, corners, normal, middle, disc, reflectivity)))
