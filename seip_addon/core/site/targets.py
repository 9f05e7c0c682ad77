"""Target points: a uniform grid on the road surface inside the region of interest.

`tests/core/site/test_targets.py` shows its use.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from ..base.arrays import Float
from ..base.errors import SeipError
from ..geometry.plan import surface_height
from .scene_geometry import NamedArea

MAX_TARGETS = 2_000_000
"""Limit on the targets of a grid."""

MIN_SPACING, MAX_SPACING = 0.01, 1000.0
"""Least and largest spacing, metres."""


@dataclass(frozen=True, eq=False)
class Targets:
    """Points of the road that sensors should cover.

    Parameters
    ----------
    xyz : (t, 3) float64, metres
        Positions on the road surface, local site axes.
    weight : (t,) float64
        Importance in the weighted problem, 1 outside every weighted region.
    central : (t,) bool
        Whether the target lies in a weighted region.
    spacing : float, metres
        Side of the square that each target represents.
    """

    xyz: Float
    weight: Float
    central: NDArray[np.bool_]
    spacing: float

    def __len__(self) -> int:
        """Return the number of targets."""
        return len(self.xyz)


def generate_targets(
    region: BaseGeometry, road: Float, spacing: float, weighted_regions: Sequence[NamedArea] = ()
) -> Targets:
    """Generate targets: the points of a uniform grid over the region that lie on the road.

    The grid is centred in the region's bounding box, so that moving the whole scene moves the targets with it. If road
    surfaces lie above each other, the target is on the highest.

    Parameters
    ----------
    region : shapely geometry
        Region of interest in plan, metres.
    road : (n, 3, 3) float64, metres
        Triangles of the road surface.
    spacing : float, metres
        Distance between neighbouring targets.
    weighted_regions : sequence of NamedArea
        Regions with weights, which multiply in overlaps.

    Returns
    -------
    Targets
        Targets in order of x, then y.

    Raises
    ------
    SeipError
        The spacing is out of range or gives too many targets, the region is empty, or no grid point lies on the road
        inside it.
    """
    if not MIN_SPACING <= spacing <= MAX_SPACING:
        raise SeipError(f"the grid spacing must be {MIN_SPACING:g} to {MAX_SPACING:g} m, not {spacing}")
    if region.is_empty:
        raise SeipError("the region of interest is empty: put a mesh over the road into SEIP Region")
    plan = _grid(region, spacing)
    height = surface_height(plan, road)
    on_road = np.isfinite(height)
    if not on_road.any():
        raise SeipError(
            f"no target: no point of the {spacing:g} m grid lies on the road inside the region of interest; "
            "let SEIP Region and SEIP Roads overlap, or choose a finer grid"
        )
    xyz = np.column_stack((plan[on_road], height[on_road]))
    weight = np.ones(len(xyz))
    central = np.zeros(len(xyz), dtype=bool)
    for area in weighted_regions:
        if not (np.isfinite(area.weight) and area.weight > 0):
            raise SeipError(f"the weight of {area.name!r} must be a positive number, not {area.weight}")
        inside = shapely.intersects_xy(area.polygon, xyz[:, 0], xyz[:, 1])
        weight[inside] *= area.weight
        central |= inside
    # Rounding to a micrometre removes noise that comes from the distant origin of map coordinates.
    return Targets(np.round(xyz, 6), weight, central, float(spacing))


def _grid(region: BaseGeometry, spacing: float) -> Float:
    low_x, low_y, high_x, high_y = region.bounds
    sides = (high_x - low_x, high_y - low_y)
    counts = [max(1, int(np.floor(side / spacing + 1e-6))) for side in sides]  # whole cells, targets in their middles
    if counts[0] * counts[1] > 50 * MAX_TARGETS or region.area / spacing**2 > MAX_TARGETS:
        raise SeipError(
            f"a grid of {spacing:g} m would lay about {region.area / spacing**2:.3g} targets in the region; "
            f"choose a coarser one (at most {MAX_TARGETS:,} targets)"
        )
    axes = [
        centre + (np.arange(count) - (count - 1) / 2) * spacing
        for count, centre in zip(counts, ((low_x + high_x) / 2, (low_y + high_y) / 2), strict=True)
    ]
    x, y = (values.ravel() for values in np.meshgrid(*axes, indexing="ij"))
    shapely.prepare(region)
    inside = shapely.intersects_xy(region, x, y)
    return np.column_stack((x[inside], y[inside]))


def target_squares(targets: Targets) -> Float:
    """Return the corners of a square around each target, draped over the slopes of the road.

    A corner shared by several squares has the mean height of their targets.

    Returns
    -------
    (t, 4, 3) float64, metres
        Corners counter-clockwise from the lower left.
    """
    half = targets.spacing / 2.0
    corners = targets.xyz[:, None, :2] + half * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    places = np.round(corners.reshape(-1, 2) / half).astype(np.int64)
    shared = np.unique(places, axis=0, return_inverse=True)[1].ravel()
    height = np.bincount(shared, np.repeat(targets.xyz[:, 2], 4)) / np.bincount(shared)
    squares: Float = np.concatenate((corners, height[shared].reshape(-1, 4, 1)), axis=2)
    return squares
