"""Triangles that can lie between a candidate and a target; all others are dropped.

Every ray that decides whether a target is seen runs from a candidate to a point within δ of a target: within the convex
hull of the candidates and of the balls of radius δ about the targets. A triangle outside that hull, or out of range of
every sensor, neither returns nor stops such a ray. A ray that leaves a convex region does not come back, so a ray that
would have met a dropped triangle decides nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
import shapely

from ...base.arrays import Boolean, Float
from .near_surfaces import caster_tolerance

_POLYGON_FACTOR = 1.01  # by which a circle's radius is enlarged, so that the polygon in its place contains the circle


@dataclass(frozen=True, eq=False)
class NeededTriangles:
    """Triangles that rays have to be cast against.

    Parameters
    ----------
    keep : (n,) bool
        Whether each triangle is needed.
    without_area, above, below, beside, out_of_range : int
        Number of triangles dropped because they have no area, lie above or below all candidates and targets, lie beside
        all lines between them, or are out of range of every candidate. A triangle that is dropped for several reasons
        counts for the first.
    """

    keep: Boolean
    without_area: int
    above: int
    below: int
    beside: int
    out_of_range: int

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of all and of kept triangles, and of dropped ones by reason."""
        reasons = {field.name: int(getattr(self, field.name)) for field in fields(self)[1:]}
        return {"all": len(self.keep), "kept": int(self.keep.sum())} | reasons


def culling_message(counts: Mapping[str, int]) -> str:
    """Return a message on the numbers of kept and dropped triangles, from `NeededTriangles.counts`."""
    reasons = {
        "without_area": "without area",
        "above": "above all lines of sight",
        "below": "below all lines of sight",
        "beside": "beside all lines of sight",
        "out_of_range": "out of range",
    }
    dropped = ", ".join(f"{counts[key]:,} {reason}" for key, reason in reasons.items() if counts[key])
    return f"rays are cast against {counts['kept']:,} of {counts['all']:,} triangles" + (
        f"; dropped: {dropped}" if dropped else ""
    )


def needed_triangles(triangles: Float, poses: Float, targets: Float, delta: float, max_range: float) -> NeededTriangles:
    """Find the triangles that can hide a target from a candidate or make it seen.

    Parameters
    ----------
    triangles : (n, 3, 3) float64, metres
        Corners of the scene's triangles.
    poses, targets : (c, 3) and (t, 3) float64, metres
        Positions of the candidates and of the targets.
    delta : float, metres
        δ, the distance within which a return sees a target.
    max_range : float, metres
        Longest range of a sensor.

    Returns
    -------
    NeededTriangles
    """
    # The hull is bounded by two simpler regions: a slab between the lowest and the highest point, and the hull in plan.
    # Triangles are compared by their boxes, which contain them, so that none that matters is dropped. All lengths
    # include what a ray caster's returns may be off.
    tolerance = caster_tolerance(triangles)
    radius = (delta + tolerance) * _POLYGON_FACTOR
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    bottom = min(poses[:, 2].min(), targets[:, 2].min() - radius) - tolerance
    top = max(poses[:, 2].max(), targets[:, 2].max() + radius) + tolerance
    around_targets = shapely.MultiPoint(targets[:, :2]).convex_hull.buffer(radius)
    around_poses = shapely.MultiPoint(poses[:, :2]).convex_hull.buffer(tolerance * _POLYGON_FACTOR)
    plan = around_poses.union(around_targets).convex_hull
    shapely.prepare(plan)
    in_plan = shapely.box(*low[:, :2].T, *high[:, :2].T)

    # exactly zero: the casters leave out such triangles as well
    edges = triangles[:, 1:] - triangles[:, :1]
    no_area = (np.cross(edges[:, 0], edges[:, 1]) == 0).all(axis=1)
    above, below = low[:, 2] > top, high[:, 2] < bottom
    beside = ~shapely.intersects(plan, in_plan)
    in_range = shapely.dwithin(shapely.MultiPoint(poses[:, :2]).convex_hull, in_plan, max_range + tolerance)
    # each triangle counts for the first reason that applies, so that the numbers add up
    left = np.ones(len(triangles), dtype=bool)
    counts = []
    for reason in (no_area, above, below, beside, ~in_range):
        counts.append(int((left & reason).sum()))
        left &= ~reason
    return NeededTriangles(left, *counts)
