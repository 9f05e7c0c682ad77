"""The visibility grid by full scans of all poses, each ray of which is cast: the reference for the grid."""

from collections.abc import Mapping

from headless.studies.benchmark.visibility import seen_by_tilted_full_scan

import numpy as np

from seip_addon.core.base.arrays import Boolean, Float
from seip_addon.core.sensing.lidar.beams import BeamPattern
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.visibility.near_surfaces import near_surfaces
from seip_addon.core.sensing.visibility.ray_casting import RayCaster
from seip_addon.core.sensing.visibility.scanning import ScanPosition
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.site.site import Site


def beam_directions(model: LidarModel, yaw: float = 0.0) -> Float:
    """Return the unit directions of one revolution or frame.

    Parameters
    ----------
    yaw : float, radians
        Direction of azimuth zero, counter-clockwise from +x.

    Returns
    -------
    (channels, azimuth_count, 3) float64
    """
    rays = np.arange(model.channels * model.azimuth_count)
    return BeamPattern(model, yaw).directions(rays).reshape(model.channels, model.azimuth_count, 3)


def full_scan(
    site: Site, models: Mapping[str, LidarModel], settings: VisibilitySettings, caster: RayCaster
) -> tuple[Boolean, int]:
    """Return the visibility of each target from each pose, (c, t) bool, and the number of rays."""
    poses = site.candidates
    surfaces = near_surfaces(site.triangles, site.targets.xyz, settings.delta, site.reflectivity)
    visible, rays = np.zeros((len(poses), len(site.targets)), dtype=bool), 0
    for pose, key in enumerate(poses.sensor.tolist()):
        position = ScanPosition(
            caster, poses.xyz[pose], float(poses.yaw[pose]), models[key], settings, site.reflectivity
        )
        seen, cast = seen_by_tilted_full_scan(position, float(poses.tilt[pose]), surfaces)
        visible[pose] = seen
        rays += cast
    return visible, rays
