"""Static geometry of a scene for scans."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Boolean, Float
from ...site.far_objects import without_far_objects
from ...site.scene_geometry import SceneGeometry, ordered_surfaces
from .sensor import MountedSensor


@dataclass(frozen=True, eq=False)
class StaticScene:
    """Static surfaces of a scene; n triangles.

    Parameters
    ----------
    triangles : (n, 3, 3) float64, metres
        Corners in local site axes.
    reflectivity : (n,) float64, 0 to 1
        Reflectivity of each triangle.
    region : shapely geometry
        Region of interest in plan.
    warnings : tuple of str
        Warnings about objects that were left out.
    attribution : tuple of str
        Credits that the sources of the scene require.
    """

    triangles: Float
    reflectivity: Float
    region: BaseGeometry
    warnings: tuple[str, ...] = ()
    attribution: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Make GEOS index the region before threads share it: it does so at the second point, without a lock."""
        if not self.region.is_empty:
            point = self.region.representative_point()
            shapely.contains_xy(self.region, [point.x, point.x], [point.y, point.y])

    def inside(self, xyz: Float) -> Boolean:
        """Return which points (k, 3) are in the region of interest in plan, (k,)."""
        return np.asarray(shapely.contains_xy(self.region, xyz[:, 0], xyz[:, 1]), dtype=bool)


def static_scene(geometry: SceneGeometry, sensors: Sequence[MountedSensor] = ()) -> StaticScene:
    """Join a scene's surfaces, in an order that does not depend on that of the objects.

    Parameters
    ----------
    sensors : sequence of MountedSensor
        Sensors; objects beyond the range of all of them are left out. Without sensors nothing is left out.
    """
    warnings: tuple[str, ...] = ()
    if sensors:
        places = shapely.MultiPoint([sensor.xyz[:2] for sensor in sensors])
        geometry, warnings = without_far_objects(geometry, places, max(s.model.max_range for s in sensors))
    surfaces = ordered_surfaces((*geometry.roads, *geometry.ground, *geometry.occluders))
    return StaticScene(*surfaces, geometry.region, warnings, geometry.attribution)
