"""Visibility of targets from sensors at arbitrary positions and orientations.

For an upright sensor, visibility is computed in the site's axes. For any other sensor it is computed in the sensor's
own axes, in which its channels are cones about z, like those of an upright one; only rays are cast in the site's axes.
"""

from __future__ import annotations

import math

from ...base.arrays import Boolean, Float
from ...site.site import Site
from ..lidar.model import LidarModel
from .near_surfaces import near_surfaces, rotated_surfaces
from .ray_casting import RayCaster, engine_name, make_ray_caster
from .scanning import ScanPosition, seen_by_near_rays
from .settings import Engine, VisibilitySettings

_MAX_LEVEL_ANGLE = 1e-6
"""Radians by which the axis of an upright sensor may deviate: Blender rotates objects in single precision."""


class VisibilityModel:
    """Visibility of targets from sensors of any model, position and orientation.

    Every result is the same as a full scan's.

    Parameters
    ----------
    targets : (t, 3) float64, metres
        Positions of the targets.
    reflectivity : (n,) float64, 0 to 1
        Reflectivity of the caster's triangles.
    caster : RayCaster
        Ray caster of the static surfaces that hide the targets.

    Examples
    --------
    >>> import numpy as np
    >>> from seip_addon.core.sensing.lidar.catalogue import load_catalogue
    >>> road = np.array([[(0, -4, 0), (50, -4, 0), (50, 4, 0)], [(0, -4, 0), (50, 4, 0), (0, 4, 0)]], dtype=float)
    >>> wall = np.array([[[20.0, -9.0, 0.0], [20.0, 9.0, 0.0], [20.0, 0.0, 9.0]]])
    >>> caster, targets = make_ray_caster(np.concatenate([road, wall])), np.array([[15.0, 0.0, 0.0], [25.0, 0.0, 0.0]])
    >>> model = VisibilityModel(targets, np.full(3, 0.3), VisibilitySettings(), caster)
    >>> model.see(load_catalogue()["os1_128"], np.array([0.0, 0.0, 5.0]), np.eye(3)).tolist()
    [True, False]
    """

    def __init__(self, targets: Float, reflectivity: Float, settings: VisibilitySettings, caster: RayCaster) -> None:
        self._caster, self._settings, self._reflectivity = caster, settings, reflectivity
        self._surfaces = near_surfaces(caster.triangles, targets, settings.delta, reflectivity)

    @property
    def targets(self) -> int:
        """Number of targets."""
        return len(self._surfaces.xyz)

    def see(self, model: LidarModel, xyz: Float, orientation: Float) -> Boolean:
        """Compute the targets that a sensor sees, (t,) bool; see `scan`."""
        return self.scan(model, xyz, orientation)[0]

    def scan(self, model: LidarModel, xyz: Float, orientation: Float) -> tuple[Boolean, int]:
        """Compute the targets that a sensor sees.

        Parameters
        ----------
        xyz : (3,) float64, metres
            Optical centre, local site axes.
        orientation : (3, 3) float64
            Rotation from the sensor's axes to the site's.

        Returns
        -------
        seen : (t,) bool
            Visibility of each target.
        cast : int
            Number of rays.
        """
        if is_upright(orientation):
            return self.scan_upright(model, xyz, yaw_of(orientation))
        position = self._position(model, xyz, 0.0).in_sensor_axes(orientation)
        return seen_by_near_rays(position, rotated_surfaces(self._surfaces, xyz, orientation))

    def scan_upright(self, model: LidarModel, xyz: Float, yaw: float) -> tuple[Boolean, int]:
        """Compute the targets that an upright sensor of a given yaw, in radians, sees; see `scan`."""
        return seen_by_near_rays(self._position(model, xyz, yaw), self._surfaces)

    def _position(self, model: LidarModel, xyz: Float, yaw: float) -> ScanPosition:
        return ScanPosition(self._caster, xyz, yaw, model, self._settings, self._reflectivity)


def visibility_model(site: Site, settings: VisibilitySettings, engine: Engine = "auto") -> VisibilityModel:
    """Return a visibility model with a ray caster of its own."""
    caster = make_ray_caster(site.triangles, engine_name(engine))
    return VisibilityModel(site.targets.xyz, site.reflectivity, settings, caster)


def is_upright(orientation: Float) -> bool:
    """Return whether a sensor with an orientation (3, 3) stands upright, except for rounding."""
    return bool(orientation[2, 2] > 0 and math.hypot(*orientation[2, :2]) < _MAX_LEVEL_ANGLE)


def yaw_of(orientation: Float) -> float:
    """Return the direction of azimuth zero of an upright sensor, in radians."""
    return math.atan2(orientation[1, 0], orientation[0, 0])
