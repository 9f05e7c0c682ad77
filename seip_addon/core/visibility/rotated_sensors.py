"""Visibility of sensors at arbitrary positions and orientations."""

from __future__ import annotations

from collections.abc import Sequence

from ..arrays import Boolean, Float
from ..lidar import LidarModel
from ..site.site import Site
from .grid import VisibilitySettings
from .near_surfaces import near_surfaces
from .ray_casting import Engine, RayCaster, engine_name, make_ray_caster
from .sight import Sight


class Onlooker:
    """Finds what a sensor of any model, place and orientation sees of a site's targets.

    Parameters
    ----------
    caster : RayCaster
        Of the site's triangles.
    """

    def __init__(self, site: Site, settings: VisibilitySettings, caster: RayCaster) -> None:
        surfaces = near_surfaces(site.triangles, site.targets.xyz, settings.delta)
        self._sight = Sight(caster, surfaces, settings.delta, settings.min_intensity)

    def see(self, model: LidarModel, xyz: Float, orientation: Float) -> Boolean:
        """Find which targets a sensor sees.

        Parameters
        ----------
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
        return self._sight.turned(models, xyz, orientation)[0]


def onlooker(site: Site, settings: VisibilitySettings, engine: Engine = "auto") -> Onlooker:
    """Return an onlooker with a ray caster of its own."""
    return Onlooker(site, settings, make_ray_caster(site.triangles, engine_name(engine)))
