"""Surfaces within δ of each target, and the heights that they span.

A return within δ of a target lies on a triangle that meets the ball of radius δ about it. The triangle's plane, at the
signed distance h from the target, cuts a disc of radius ρ = √(δ² − h²) out of the ball. With the unit normal n, the
disc reaches ρ·√(1 − n_z²) above and below its centre. On a road that is a slab a few centimetres thick instead of a
ball, so that rays passing over a target can be ruled out. All this depends on neither pose nor sensor.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
import shapely

from ...base.arrays import Boolean, Float, Integer
from ...geometry.orientation import rotated

_TARGETS_AT_ONCE = 2048  # bounds the memory of the pairs of targets and triangles

_MIN_TOLERANCE = 1e-3  # metres
_FLOAT32_ROUNDINGS = 64


@dataclass(frozen=True, eq=False)
class Cuts:
    """Discs: intersections of balls of radius δ about targets with the planes of triangles.

    Parameters
    ----------
    target : (k,) int64
        Target of each disc, ascending.
    corners : (k, 3, 3) float64, metres
        Corners of the triangle.
    normal : (k, 3) float64
        Unit normals of the triangle.
    middle : (k, 3) float64, metres
        Centre of the disc.
    radius : (k,) float64, metres
        Radius of the disc.
    reflectivity : (k,) float64, 0 to 1
        Reflectivity of the triangle.
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
        """Return which points (k, 3) lie on their triangle, within a margin in metres; (k,) bool."""
        near: Boolean = np.abs(((points - self.corners[:, 0]) * self.normal).sum(axis=1)) <= margin
        return near & _within_sides(points, self.corners, self.normal, margin)

    def heights(self, tolerance: float) -> tuple[Float, Float]:
        """Return the heights (k,) between which disc and triangle meet; low > high if they do not."""
        # The intersection of the two intervals, that of the tilted disc and that of the corners. The tolerance is added
        # before the two are compared: on a level face both intervals are a single height, except for rounding, and
        # without it the face might be lost.
        half = self.radius * np.sqrt(np.maximum(1 - self.normal[:, 2] ** 2, 0.0))
        low = np.maximum(self.middle[:, 2] - half, self.corners[:, :, 2].min(axis=1)) - tolerance
        high = np.minimum(self.middle[:, 2] + half, self.corners[:, :, 2].max(axis=1)) + tolerance
        return low, high


@dataclass(frozen=True, eq=False)
class NearSurfaces:
    """Surfaces on which returns within δ of targets can lie.

    Parameters
    ----------
    xyz : (t, 3) float64, metres
        Targets.
    low, high : (t,) float64, metres
        Heights between which there are surfaces within δ of each target; low > high if there is none.
    radius : float, metres
        δ plus the tolerance: returns that see a target are nearer than this in plan.
    cuts : Cuts
        Each of the surfaces.
    tolerance : float, metres
        Largest distance of a ray caster's returns from the surfaces. All heights and radii include it.
    """

    xyz: Float
    low: Float
    high: Float
    radius: float
    cuts: Cuts
    tolerance: float


def near_surfaces(triangles: Float, targets: Float, delta: float, reflectivity: Float) -> NearSurfaces:
    """Find the surfaces near targets.

    Parameters
    ----------
    triangles : (n, 3, 3) float64, metres
        Corners of the scene's triangles.
    targets : (t, 3) float64, metres
        Positions of the targets.
    delta : float, metres
        δ, the distance within which a return sees a target.
    reflectivity : (n,) float64, 0 to 1
        Reflectivity of the triangles.

    Returns
    -------
    NearSurfaces
    """
    tolerance = caster_tolerance(triangles)
    radius = delta + tolerance
    # A spatial index of the triangles' boxes in plan gives the pairs of target and triangle that may meet; the exact
    # test follows in `_cut`. Targets are processed in batches, as pairs take more memory than either.
    in_plan = shapely.STRtree(shapely.box(*triangles[:, :, :2].min(axis=1).T, *triangles[:, :, :2].max(axis=1).T))
    parts = []
    for begin in range(0, len(targets), _TARGETS_AT_ONCE):
        xy = targets[begin : begin + _TARGETS_AT_ONCE, :2]
        near, triangle = in_plan.query(shapely.box(*(xy - radius).T, *(xy + radius).T))
        # sorted by target, on which the slices in `ScanPosition.counting_at_borders` rely
        order = np.argsort(near, kind="stable")
        target = near[order] + begin
        parts.append(_cut(triangles[triangle[order]], targets[target], target, radius, reflectivity[triangle[order]]))
    cuts = Cuts(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Cuts)))
    return _about(targets, radius, cuts, tolerance)


def rotated_surfaces(surfaces: NearSurfaces, origin: Float, orientation: Float) -> NearSurfaces:
    """Return the same surfaces in the axes of a sensor at any position and orientation.

    Parameters
    ----------
    surfaces : NearSurfaces
        Surfaces in the site's axes.
    origin : (3,) float64, metres
        Position of the sensor.
    orientation : (3, 3) float64
        Rotation from the sensor's axes to the site's.
    """
    # the pairs of triangles and targets stay the same; only their heights depend on the axes
    cuts = surfaces.cuts
    rotated_cuts = replace(
        cuts,
        # as one list of points: a separate product for each triangle is many times slower
        corners=((cuts.corners - origin).reshape(-1, 3) @ orientation).reshape(-1, 3, 3),
        normal=cuts.normal @ orientation,
        middle=(cuts.middle - origin) @ orientation,
    )
    targets = rotated(surfaces.xyz - origin, orientation.T)
    return _about(targets, surfaces.radius, rotated_cuts, surfaces.tolerance)


def _about(targets: Float, radius: float, cuts: Cuts, tolerance: float) -> NearSurfaces:
    """Return the surfaces, with the joint heights of the discs of each target."""
    low, high = np.full(len(targets), np.inf), np.full(len(targets), -np.inf)
    least, most = cuts.heights(tolerance)
    meet = least <= most
    np.minimum.at(low, cuts.target[meet], least[meet])
    np.maximum.at(high, cuts.target[meet], most[meet])
    return NearSurfaces(targets, low, high, radius, cuts, tolerance)


def caster_tolerance(triangles: Float) -> float:
    """Return a generous bound on the distance of a float32 ray caster's returns from the triangles, in metres."""
    if len(triangles) == 0:
        return _MIN_TOLERANCE
    points = triangles.reshape(-1, 3)
    extent = float((points.max(axis=0) - points.min(axis=0)).max())
    return max(_MIN_TOLERANCE, _FLOAT32_ROUNDINGS * float(np.finfo(np.float32).eps) * extent)


def _cut(corners: Float, centre: Float, target: Integer, ball: float, reflectivity: Float) -> Cuts:
    """Cut triangles with balls, pair by pair; the result may contain pairs that just miss each other near a corner."""
    # A disc and a triangle in the same plane: the disc meets the triangle only if its centre is no farther outside any
    # side than its radius. That is necessary, and near a corner not sufficient.
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    normal /= np.where(length > 0, length, 1.0)[:, None]
    above = ((centre - corners[:, 0]) * normal).sum(axis=1)
    disc = np.sqrt(np.maximum(ball**2 - above**2, 0.0))
    meets = (length > 0) & (np.abs(above) < ball)
    meets &= _within_sides(centre, corners, normal, disc)
    middle = centre - above[:, None] * normal
    return Cuts(*(part[meets] for part in (target, corners, normal, middle, disc, reflectivity)))


def _within_sides(points: Float, corners: Float, normal: Float, margin: Float | float) -> Boolean:
    """Return which points (k, 3) are at no side of their triangle farther outside, in its plane, than a margin."""
    within = np.ones(len(points), dtype=bool)
    for side in range(3):
        edge = corners[:, (side + 1) % 3] - corners[:, side]
        outward = np.cross(edge, normal)  # as long as the edge
        within &= ((points - corners[:, side]) * outward).sum(axis=1) <= margin * np.linalg.norm(edge, axis=1)
    return within
