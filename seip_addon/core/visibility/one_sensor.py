"""What one sensor sees, wherever it hangs and however it is turned: for sensors that a hand moves."""

from __future__ import annotations

import math

import numpy as np

from ..arrays import Boolean, Float
from ..lidar import BeamPattern
from ..scans.sensor import MountedSensor
from ..site import Site
from .grid import VisibilitySettings
from .near_surfaces import near_surfaces
from .ray_casting import Engine, make_ray_caster
from .scanning import Place, seen_by_near_rays
from .target_index import TargetIndex

_LEVEL = 1e-6
"""Radians that a level sensor's axis may be off the vertical: single precision."""


class Onlooker:
    """Looks at the targets of a site through single sensors; what is the same for all is computed once.

    Parameters
    ----------
    site : Site
    settings : VisibilitySettings
    engine : {"auto", "bvh", "embree"}
        What casts the rays.
    """

    def __init__(self, site: Site, settings: VisibilitySettings, engine: Engine = "auto") -> None:
        self._settings = settings
        self._caster = make_ray_caster(site.triangles, engine)
        self._surfaces = near_surfaces(site.triangles, site.targets.xyz, settings.delta)
        self._index = TargetIndex(site.targets.xyz, settings.delta)

    def seen_from(self, sensor: MountedSensor) -> Boolean:
        """Tell which targets a sensor sees, (t,) bool: for a level one the same as the visibility grid does."""
        if math.hypot(*sensor.orientation[2, :2]) > _LEVEL:
            return self._by_all_rays(sensor)
        yaw = math.atan2(sensor.orientation[1, 0], sensor.orientation[0, 0])
        seen, _ = seen_by_near_rays(self._place(sensor, yaw), self._surfaces)
        row: Boolean = seen[0]
        return row

    def _by_all_rays(self, sensor: MountedSensor) -> Boolean:
        """Cast all rays of a tilted sensor that reach the heights of targets: more is known of level ones alone."""
        model = sensor.model
        rays = np.arange(model.channels * model.azimuth_count)
        directions: Float = BeamPattern(model).directions(rays) @ sensor.orientation.T
        directions = directions[self._reaches_targets(sensor.xyz[2], directions[:, 2] * model.max_range)]
        distance, triangle = self._caster.cast(sensor.xyz, directions, model.max_range)
        counts = self._place(sensor, 0.0).counting(model, directions, distance, triangle)
        points = sensor.xyz + distance[counts, None] * directions[counts]
        seen = np.zeros(len(self._surfaces.xyz), dtype=bool)
        seen[self._index.within_delta(points)] = True
        return seen

    def _reaches_targets(self, height: float, rise: Float) -> Boolean:
        """Tell which rays come to where a return could be near a target, given where they begin and how they rise."""
        xyz, delta = self._surfaces.xyz, self._settings.delta
        lowest, highest = xyz[:, 2].min() - delta, xyz[:, 2].max() + delta
        reaches: Boolean = (height + np.minimum(rise, 0.0) <= highest) & (height + np.maximum(rise, 0.0) >= lowest)
        return reaches

    def _place(self, sensor: MountedSensor, yaw: float) -> Place:
        delta, least = self._settings.delta, self._settings.min_intensity
        return Place(self._caster, sensor.xyz, yaw, [sensor.model], delta, least)
