"""Range of LiDARs on the road of a site: the distance up to which its returns are detected.

At a distance r, a sensor h above a level road meets it at an angle whose cosine is h / r. So the power of the return
falls with r³, faster than that of a wall.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import shapely

from ...base.arrays import Float
from ...site.scene_geometry import Mesh, ordered_surfaces
from ...site.site import Site
from ..lidar.catalogue import find_models
from ..lidar.model import LidarModel
from ..lidar.range_equation import RangeEquation
from .settings import VisibilitySettings

NEARLY_ALL = 0.01
"""Least share of the targets beyond the range of a sensor type for a warning."""


def road_reflectivity(roads: Sequence[Mesh]) -> float:
    """Return the median reflectivity of the road by area."""
    corners, share = ordered_surfaces(roads)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    order = np.argsort(share, kind="stable")
    below = np.cumsum(area[order])
    return float(share[order][np.searchsorted(below, below[-1] / 2)])


def road_range(model: LidarModel, reflectivity: float, height: float, settings: VisibilitySettings) -> float:
    """Return the distance in metres up to which a sensor detects a level road.

    Parameters
    ----------
    reflectivity : float, 0 to 1
        Reflectivity of the road.
    height : float, metres
        Height of the sensor above the road.
    """
    if not isinstance(model.law, RangeEquation):
        return model.max_range
    return min(model.law.reach_on_level(reflectivity, settings.detection, height), model.max_range)


def upright_range(model: LidarModel, reflected: float, settings: VisibilitySettings) -> float:
    """Return the distance in metres up to which a sensor detects an upright body.

    Parameters
    ----------
    reflected : float, 0 to 1
        Reflectivity of the body times the cosine of the angle of incidence; see `returns.bodies.PANELS`.
    """
    return min(model.law.reach(reflected, settings.detection), model.max_range)


def range_warnings(
    site: Site, models: Mapping[str, LidarModel], reflectivity: float, settings: VisibilitySettings
) -> tuple[str, ...]:
    """Return warnings about sensor types whose range on this road leaves out a share of the region.

    Parameters
    ----------
    models : mapping of str to LidarModel
        Sensor types by catalogue key, those of all candidates included.
    reflectivity : float, 0 to 1
        Reflectivity of the road.
    """
    poses, warnings = site.candidates, []
    for key, model in find_models(models, np.unique(poses.sensor).tolist()).items():
        if not isinstance(model.law, RangeEquation):
            continue
        of_type = poses.sensor == key
        heights = poses.height[of_type]
        reach = np.array([road_range(model, reflectivity, float(height), settings) for height in np.unique(heights)])
        beyond = _share_beyond(site, poses.xyz[of_type], reach[np.searchsorted(np.unique(heights), heights)])
        assumed = f"; {model.assumed}" if model.assumed else ""
        if beyond >= NEARLY_ALL or assumed:
            warnings.append(
                f"{key}: a road surface that reflects {reflectivity:.0%} of the light is detected with "
                f"{settings.detection:.0%} probability up to {reach.max():.0f} m from {heights.max():g} m height"
                f"{_beyond_message(beyond)}; vehicles are detected much farther{assumed}"
            )
    return tuple(warnings)


def _beyond_message(share: float) -> str:
    return f": {share:.0%} of the region lies beyond its range from every candidate" if share >= NEARLY_ALL else ""


def _share_beyond(site: Site, xyz: Float, reach: Float) -> float:
    """Return the share of targets that are out of reach (n,) of all sensors at positions (n, 3)."""
    targets = site.targets.xyz
    near = np.zeros(len(targets), dtype=bool)
    points = shapely.points(targets[:, :2])
    tree = shapely.STRtree(points)
    for one, far in zip(xyz, reach, strict=True):
        found = tree.query(shapely.Point(one[:2]), predicate="dwithin", distance=far)
        found = found[~near[found]]
        near[found[np.linalg.norm(targets[found] - one, axis=1) <= far]] = True
        if near.all():
            return 0.0
    return float(1.0 - near.mean())
