"""Views of sensors at arbitrary positions and orientations, with shared ray casts.

What an upright sensor sees is computed in the site's axes. For any other all is
computed in the sensor's own axes, where its channels are cones about z as those
of an upright one are; only rays go out in the site's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Boolean, Float, Integer
from ..geometry.orientation import orientation as orientation_of
from ..geometry.orientation import turned
from ..lidar import LidarModel
from .near_surfaces import NearSurfaces, turned_surfaces
from .scanning import Caster, Place, seen_by_all_rays, seen_by_near_rays

_LEVEL = 1e-6
"""Radians that an upright sensor's axis may be off: Blender turns objects in single precision."""


@dataclass(frozen=True, eq=False)
class Sight:
    """What looks from all places have in common.

    Parameters
    ----------
    caster : Caster
        Of the site's triangles.
    surfaces : NearSurfaces
        About the targets, for that δ.
    delta : float, metres
    """

    caster: Caster
    surfaces: NearSurfaces
    delta: float
    min_intensity: float

    def level(self, models: Sequence[LidarModel], xyz: Float, yaw: float) -> tuple[Boolean, int]:
        """Find which targets upright sensors see from one place, sharing rays.

        Parameters
        ----------
        xyz : (3,) float64, metres
            Optical centre, local site axes.
        yaw : float, radians
            Direction of azimuth zero.

        Returns
        -------
        seen : (models, t) bool
            The same as a full scan's.
        cast : int
            Number of rays.
        """
        return seen_by_near_rays(self._place(models, xyz, yaw), self.surfaces)

    def turned(self, models: Sequence[LidarModel], xyz: Float, orientation: Float) -> tuple[Boolean, int]:
        """Find which targets sensors of any orientation, (3, 3) from their axes to the site's, see; see `level`."""
        if _is_upright(orientation):
            return self.level(models, xyz, _yaw(orientation))
        place = _in_sensor_axes(self._place(models, xyz, 0.0), orientation)
        return seen_by_near_rays(place, turned_surfaces(self.surfaces, xyz, orientation))

    def _place(self, models: Sequence[LidarModel], xyz: Float, yaw: float) -> Place:
        return Place(self.caster, xyz, yaw, models, self.delta, self.min_intensity)


def seen_by_tilted_full_scan(place: Place, tilt: float, targets: Float) -> tuple[Boolean, int]:
    """Find which targets sensors see that are tilted by an angle (radians), by casting every ray: the reference."""
    if tilt == 0:
        return seen_by_all_rays(place, targets)
    orientation = orientation_of(place.yaw, tilt)
    if _is_upright(orientation):
        return seen_by_all_rays(replace(place, yaw=_yaw(orientation)), targets)
    return seen_by_all_rays(_in_sensor_axes(place, orientation), turned(targets - place.origin, orientation.T))


def _is_upright(orientation: Float) -> bool:
    return bool(orientation[2, 2] > 0 and math.hypot(*orientation[2, :2]) < _LEVEL)


def _yaw(orientation: Float) -> float:
    return math.atan2(orientation[1, 0], orientation[0, 0])


def _in_sensor_axes(place: Place, orientation: Float) -> Place:
    """Return a place in the axes of its sensors."""
    caster = _TurnedCaster(place.caster, place.origin, orientation)
    return replace(place, caster=caster, origin=np.zeros(3), yaw=0.0)


@dataclass(frozen=True, eq=False)
class _TurnedCaster:
    """A ray caster in the axes of a sensor."""

    caster: Caster
    origin: Float
    orientation: Float

    @property
    def triangles(self) -> _TurnedTriangles:
        return _TurnedTriangles(self)

    def cast(self, origin: Float, directions: Float, max_range: float) -> tuple[Float, Integer]:
        """Cast rays, given in the sensor's axes."""
        start = self.origin + origin @ self.orientation.T
        return self.caster.cast(start, turned(directions, self.orientation), max_range)


@dataclass(frozen=True, eq=False)
class _TurnedTriangles:
    """The triangles of a ray caster in the axes of a sensor, turned as they are asked for."""

    turned: _TurnedCaster

    def __getitem__(self, which: Integer) -> Float:
        corners: Float = (self.turned.caster.triangles[which] - self.turned.origin) @ self.turned.orientation
        return corners
