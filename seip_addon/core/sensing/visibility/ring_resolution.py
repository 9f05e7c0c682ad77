"""Warnings about rings that are too far apart for δ and the grid spacing.

On a level road h below the sensor, the channel of elevation -φ draws a ring of radius h / tan φ. Where neighbouring
rings are more than 2δ apart, targets between them are not seen although nothing hides them. A sensor tilted by θ draws
the ring of elevation -φ - θ in the direction of the tilt, and in the opposite direction that of -φ + θ, where rings are
farther apart.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ...base.arrays import Float
from ...site.site import Site
from ..lidar.catalogue import find_models
from ..lidar.model import LidarModel
from .settings import VisibilitySettings


def resolution_warnings(site: Site, models: Mapping[str, LidarModel], settings: VisibilitySettings) -> tuple[str, ...]:
    """Return warnings about rings too far apart: there, coverage depends on beams, not on line of sight.

    Parameters
    ----------
    models : mapping of str to LidarModel
        Sensor types by catalogue key, those of all candidates included.

    Returns
    -------
    tuple of str
        One warning for each sensor type with such rings, and one if targets are too far apart for δ.
    """
    poses = site.candidates
    warnings = []
    for key, model in find_models(models, np.unique(poses.sensor).tolist()).items():
        of_type = poses.sensor == key
        reach = min(model.max_range, _farthest(poses.xyz[of_type], site.targets.xyz))
        height = np.round(poses.height, 2)
        beyond = []
        for level in np.unique(height[of_type]):
            tilts = np.unique(poses.tilt[of_type & (height == level)])
            limit = min(unresolved_from(model, float(level), settings.delta, reach, float(tilt)) for tilt in tilts)
            if limit < reach:
                beyond.append(f"{limit:.0f} m (at {level:g} m height)")
        where = " in front of it (behind a tilted sensor from a shorter distance)" if poses.tilt[of_type].any() else ""
        if beyond:
            warnings.append(
                f"{key}: beyond {', '.join(beyond)} neighbouring rings on a level road{where} are more than "
                f"{2 * settings.delta:g} m apart, so the road between them is not seen although nothing hides it"
            )
    if settings.delta < site.targets.spacing / math.sqrt(2):
        warnings.append(
            f"targets are {site.targets.spacing:g} m apart and δ is {settings.delta:g} m: some of the road is not "
            f"within δ of any target; use a grid of at most {math.floor(141 * settings.delta) / 100:g} m"
        )
    return tuple(warnings)


def unresolved_from(model: LidarModel, height: float, delta: float, reach: float, tilt: float = 0.0) -> float:
    """Return the radius beyond which some neighbouring returns on a level road are more than 2δ apart.

    Parameters
    ----------
    height : float, metres
        Height of the sensor above the road.
    delta, reach : float, metres
        δ, and the radius up to which the road is examined.
    tilt : float, radians
        Tilt of the sensor; the road is examined in the direction of the tilt.

    Returns
    -------
    float, metres
        The radius, or ``reach`` if all of the road is resolved.
    """
    down = tilt - model.elevations
    down = np.sort(down[(down > 0) & (down <= math.pi / 2)])[::-1]
    rings = height / np.tan(down)
    rings = np.append(rings[rings < reach], reach)
    wide = np.flatnonzero(np.diff(rings) > 2 * delta)
    along = 2 * delta / model.azimuth_step  # radius at which neighbours in a ring are 2δ apart
    return float(min(rings[wide[0]] if len(wide) else reach, along, reach))


def _farthest(poses: Float, targets: Float) -> float:
    """Return the largest distance in plan between a pose and a target."""
    return max(float(np.hypot(*(targets[:, :2] - pose[:2]).T).max()) for pose in poses)
