"""Warnings about rings that are too far apart for δ and the grid spacing.

On a level road h below the sensor, the channel of elevation -φ draws a ring of radius h / tan φ. Where neighbouring
rings are more than 2δ apart, targets between them are not seen although nothing hides them. A sensor tilted by θ draws
the ring of elevation -φ - θ in the direction of the tilt, and in the opposite direction that of -φ + θ, where rings are
farther apart.

A rosette draws a line whose gaps can have any shape. Points of a level road within its field of view are tested for a
ray of a frame that ends within δ of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from ...base.arrays import Boolean, Float
from ...geometry.orientation import orientation
from ...site.site import Site
from ..lidar.beams import BeamPattern
from ..lidar.catalogue import find_models
from ..lidar.model import LidarModel
from .settings import VisibilitySettings
from .target_index import TargetIndex

_RADII, _AZIMUTHS = 300, 361
"""Numbers of radii and azimuths at which a level road is tested for gaps of a rosette."""


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
        if model.rosette is not None:
            warnings += _of_rosette(model, site, of_type, settings.delta, reach)
            continue
        upright = of_type & (poses.tilt == 0)
        heights = np.unique(np.round(poses.height[upright], 2))
        limits = [(height, unresolved_from(model, float(height), settings.delta, reach)) for height in heights]
        beyond = [f"{limit:.0f} m (at {height:g} m height)" for height, limit in limits if limit < reach]
        if beyond:
            warnings.append(
                f"{key}: beyond {', '.join(beyond)} neighbouring rings on a level road are more than "
                f"{2 * settings.delta:g} m apart, so the road between them is not seen although nothing hides it"
            )
        warnings += _of_tilted(model, site, of_type & ~upright, settings.delta, reach)
    if settings.delta < site.targets.spacing / math.sqrt(2):
        warnings.append(
            f"targets are {site.targets.spacing:g} m apart and δ is {settings.delta:g} m: some of the road is not "
            f"within δ of any target; use a grid of at most {math.floor(141 * settings.delta) / 100:g} m"
        )
    return tuple(warnings)


def _of_rosette(model: LidarModel, site: Site, of_type: Boolean, delta: float, reach: float) -> list[str]:
    """Return a warning on the radius beyond which the rosettes of a type leave gaps that are too wide for δ."""
    beyond = _limits(model, site, of_type, delta, reach)
    warning = (
        f"{model.key}: beyond {', '.join(beyond)} parts of a level road in view are more than δ = {delta:g} m from all "
        f"rays of a frame of {1 / model.rotation_rate:g} s, so they are not seen although nothing hides them"
    )
    return [warning] if beyond else []


def _of_tilted(model: LidarModel, site: Site, tilted: Boolean, delta: float, reach: float) -> list[str]:
    """Return a warning on the radius beyond which the tilted sensors of a type do not resolve δ."""
    beyond = _limits(model, site, tilted, delta, reach)
    warning = (
        f"{model.key}: if tilted, beyond {', '.join(beyond)} neighbouring rings on a level road in front of it are "
        f"more than {2 * delta:g} m apart, and behind it at a shorter distance, so the road between them is not "
        "seen although nothing hides it"
    )
    return [warning] if beyond else []


def _limits(model: LidarModel, site: Site, some: Boolean, delta: float, reach: float) -> list[str]:
    """Return the radii of `unresolved_from` within reach for some of the poses, (c,) bool, with their heights."""
    poses = site.candidates
    height = np.round(poses.height, 2)
    beyond = []
    for level in np.unique(height[some]):
        tilts = np.unique(poses.tilt[some & (height == level)])
        limit = min(unresolved_from(model, float(level), delta, reach, float(tilt)) for tilt in tilts)
        if limit < reach:
            beyond.append(f"{limit:.0f} m (at {level:g} m height)")
    return beyond


def unresolved_from(model: LidarModel, height: float, delta: float, reach: float, tilt: float = 0.0) -> float:
    """Return the radius beyond which some neighbouring returns on a level road are more than 2δ apart.

    For a rosette it is the radius beyond which some of the road in view has no return of a frame within δ.

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
    if model.rosette is not None:
        return _first_gap(model, height, delta, min(reach, model.max_range), tilt)
    down = tilt - model.elevations
    down = np.sort(down[(down > 0) & (down <= math.pi / 2)])[::-1]
    rings = height / np.tan(down)
    rings = np.append(rings[rings < reach], reach)
    wide = np.flatnonzero(np.diff(rings) > 2 * delta)
    along = 2 * delta / model.azimuth_step  # radius at which neighbours in a ring are 2δ apart
    return float(min(rings[wide[0]] if len(wide) else reach, along, reach))


@lru_cache(maxsize=256)
def _first_gap(model: LidarModel, height: float, delta: float, reach: float, tilt: float) -> float:
    """Return the radius of the nearest point of a level road in view of a rosette that has no ray within δ, metres."""
    axes = orientation(0.0, tilt)
    beams = BeamPattern(model).directions(np.arange(model.channels)) @ axes.T
    down = beams[beams[:, 2] < 0]
    hits = np.column_stack([down[:, :2] * (-height / down[:, 2:]), np.zeros(len(down))])
    radius, azimuth = np.meshgrid(np.linspace(0.0, reach, _RADII + 1)[1:], np.linspace(-math.pi, math.pi, _AZIMUTHS))
    road = np.column_stack([(radius * np.cos(azimuth)).ravel(), (radius * np.sin(azimuth)).ravel()])
    seen_from = np.column_stack([road, np.full(len(road), -height)]) @ axes
    road = road[model.faces(seen_from) & (np.linalg.norm(seen_from, axis=1) <= reach)]
    if not len(road):
        return reach
    index = TargetIndex(np.column_stack([road, np.zeros(len(road))]), delta)
    missed = np.ones(len(road), dtype=bool)
    missed[index.pairs_within_delta(hits)[1]] = False
    return float(np.hypot(*road[missed].T).min(initial=reach))


def _farthest(poses: Float, targets: Float) -> float:
    """Return the largest distance in plan between a pose and a target."""
    return max(float(np.hypot(*(targets[:, :2] - pose[:2]).T).max()) for pose in poses)
