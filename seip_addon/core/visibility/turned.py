"""What sensors see that hang anywhere and are turned anyhow: knocked, tilted, or moved by hand.

Everything is computed in the sensor's own axes, where its channels are cones
about z as those of an upright sensor are; only rays go out in the site's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Boolean, Float, Integer
from ..lidar import LidarModel
from ..site import Site
from .grid import VisibilitySettings
from .near_surfaces import near_surfaces, turned_surfaces
from .ray_casting import Engine, RayCaster, engine_name, make_ray_caster
from .scanning import Place, seen_by_near_rays

_LEVEL = 1e-6
"""Radians that an upright sensor's axis may be off: Blender turns objects in single precision."""


class Onlooker:
    """Finds what a sensor of any model, place and orientation sees of a site's targets.

    Parameters
    ----------
    site : Site
    settings : VisibilitySettings
    caster : RayCaster
        Of the site's triangles.
    """

    def __init__(self, site: Site, settings: VisibilitySettings, caster: RayCaster) -> None:
        self._settings, self._caster = settings, caster
        self._surfaces = near_surfaces(site.triangles, site.targets.xyz, settings.delta)

    def see(self, model: LidarModel, xyz: Float, orientation: Float) -> Boolean:
        """Find which targets a sensor sees.

        Parameters
        ----------
        model : LidarModel
        xyz : (3,) float64, metres
            Optical centre, local site axes.
        orientation : (3, 3) float64
            Rotation from the sensor's axes to the site's.

        Returns
        -------
        (t,) bool
            The same as a full scan's.
        """
        only: Boolean = self.see_all([model], xyz, orientation)[0]
        return only

    def see_all(self, models: Sequence[LidarModel], xyz: Float, orientation: Float) -> Boolean:
        """Find which targets sensors of several models see from one place, sharing rays; see `see`.

        Returns
        -------
        (models, t) bool
        """
        delta, least = self._settings.delta, self._settings.min_intensity
        if orientation[2, 2] > 0 and math.hypot(*orientation[2, :2]) < _LEVEL:
            yaw = math.atan2(orientation[1, 0], orientation[0, 0])
            place, surfaces = Place(self._caster, xyz, yaw, models, delta, least), self._surfaces
        else:
            turned = _TurnedCaster(self._caster, xyz, orientation)
            place = Place(turned, np.zeros(3), 0.0, models, delta, least)
            surfaces = turned_surfaces(self._surfaces, xyz, orientation)
        return seen_by_near_rays(place, surfaces)[0]


def onlooker(site: Site, settings: VisibilitySettings, engine: Engine = "auto") -> Onlooker:
    """Return an onlooker with a ray caster of its own."""
    return Onlooker(site, settings, make_ray_caster(site.triangles, engine_name(engine)))


@dataclass(frozen=True, eq=False)
class _TurnedCaster:
    """A ray caster in the axes of a sensor."""

    caster: RayCaster
    origin: Float
    orientation: Float

    @property
    def triangles(self) -> _TurnedTriangles:
        return _TurnedTriangles(self)

    def cast(self, origin: Float, directions: Float, max_range: float) -> tuple[Float, Integer]:
        """Cast rays, given in the sensor's axes."""
        start = self.origin + origin @ self.orientation.T
        return self.caster.cast(start, directions @ self.orientation.T, max_range)


@dataclass(frozen=True, eq=False)
class _TurnedTriangles:
    """The triangles of a ray caster in the axes of a sensor, turned as they are asked for."""

    turned: _TurnedCaster

    def __getitem__(self, which: Integer) -> Float:
        corners: Float = (self.turned.caster.triangles[which] - self.turned.origin) @ self.turned.orientation
        return corners
