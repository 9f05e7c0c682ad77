"""Visibility of targets from sensors at arbitrary positions and orientations.

For an upright sensor, visibility is computed in the site's axes. For any other sensor it is computed in the sensor's
own axes, in which its channels are cones about z, like those of an upright one; only rays are cast in the site's axes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...base.arrays import Boolean, Float, Integer
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
        """Compute the targets that one sensor sees, (t,) bool; see `see_all`."""
        only: Boolean = self.see_all([model], xyz, orientation)[0][0]
        return only

    def see_all(self, models: Sequence[LidarModel], xyz: Float, orientation: Float) -> tuple[Boolean, int]:
        """Compute the targets that sensors of several models see from one position; they share rays.

        Parameters
        ----------
        xyz : (3,) float64, metres
            Optical centre, local site axes.
        orientation : (3, 3) float64
            Rotation from the sensors' axes to the site's.

        Returns
        -------
        seen : (models, t) bool
            Visibility of each target from each sensor.
        cast : int
            Number of rays.
        """
        if is_upright(orientation):
            return self.see_upright(models, xyz, yaw_of(orientation))
        position = self._position(models, xyz, 0.0).in_sensor_axes(orientation)
        return seen_by_near_rays(position, rotated_surfaces(self._surfaces, xyz, orientation))

    def see_upright(self, models: Sequence[LidarModel], xyz: Float, yaw: float) -> tuple[Boolean, int]:
        """Compute the targets that upright sensors of a given yaw, in radians, see; see `see_all`."""
        return seen_by_near_rays(self._position(models, xyz, yaw), self._surfaces)

    def _position(self, models: Sequence[LidarModel], xyz: Float, yaw: float) -> ScanPosition:
        return ScanPosition(self._caster, xyz, yaw, models, self._settings, self._reflectivity)


def visibility_model(site: Site, settings: VisibilitySettings, engine: Engine = "auto") -> VisibilityModel:
    """Return a visibility model with a ray caster of its own."""
    caster = make_ray_caster(site.triangles, engine_name(engine))
    return VisibilityModel(site.targets.xyz, site.reflectivity, settings, caster)


def sharing_rays(xyz: Float, yaw: Float, tilt: Float) -> list[Integer]:
    """Group poses that have position, yaw and tilt in common: their sensors can share rays.

    Parameters
    ----------
    xyz : (c, 3) float64, metres
    yaw, tilt : (c,) float64, radians

    Returns
    -------
    list of (k,) int64
        Indices of the poses of each group, in the order of their first poses.
    """
    _, first, group = np.unique(np.column_stack([xyz, yaw, tilt]), axis=0, return_index=True, return_inverse=True)
    # np.unique numbers the groups by their coordinates; the rank of a group's first pose renumbers them in the order of
    # the candidates. A stable sort by group then keeps that order within each group.
    rank = np.argsort(np.argsort(first))[group.ravel()]
    order = np.argsort(rank, kind="stable")
    return np.split(order, np.cumsum(np.bincount(rank))[:-1])


def is_upright(orientation: Float) -> bool:
    """Return whether a sensor with an orientation (3, 3) stands upright, except for rounding."""
    return bool(orientation[2, 2] > 0 and math.hypot(*orientation[2, :2]) < _MAX_LEVEL_ANGLE)


def yaw_of(orientation: Float) -> float:
    """Return the direction of azimuth zero of an upright sensor, in radians."""
    return math.atan2(orientation[1, 0], orientation[0, 0])
