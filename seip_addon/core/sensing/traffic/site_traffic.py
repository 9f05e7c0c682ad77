"""Trajectories of a scene's own traffic: read from a file, and checked against the road of the scene."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.errors import SeipError
from ...site.scene_geometry import SceneGeometry, joined
from .road_fit import ROAD_TOLERANCE, RoadSurface
from .trajectories import Trajectories

MIN_ON_ROAD = 0.98  # share of vehicle positions on the road below which traffic belongs to another site
MAX_SAMPLES = 2_000  # largest number of samples used to recognise traffic of another site


def load_trajectories(path: Path, geometry: SceneGeometry) -> Trajectories:
    """Read trajectories into a scene's axes.

    Raises
    ------
    SeipError
        The file cannot be read, or it is traffic of another site.
    """
    trajectories = Trajectories.load(path).moved_to(geometry.origin)
    require_own_traffic(trajectories, geometry, str(path))
    return trajectories


def require_own_traffic(trajectories: Trajectories, geometry: SceneGeometry, name: str) -> None:
    """Check that vehicles drive on the road of a scene, as those of its own traffic do without exception.

    Parameters
    ----------
    trajectories : Trajectories
        Trajectories in the scene's local axes.
    name : str
        Name of the traffic, for messages.

    Raises
    ------
    SeipError
        Too many vehicles are off the road: the traffic belongs to another site, or the scene has changed.
    """
    share = _share_on_road(trajectories, geometry)
    if share < MIN_ON_ROAD:
        raise SeipError(
            f"traffic of another site: {1 - share:.0%} of the vehicle positions of {name} are off the road of this "
            "scene; import or simulate traffic for it"
        )


def _share_on_road(local: Trajectories, geometry: SceneGeometry) -> float:
    """Return the share of vehicle samples that are on the road; 1 without vehicles, 0 if all are elsewhere.

    Samples are those near the region of interest or, if no vehicle comes near it, those within the extent of the roads.
    A sample within `ROAD_TOLERANCE` of the road, in plan and in height, is on it.
    """
    user = np.repeat(np.arange(len(local)), np.diff(local.first))
    drives = np.array([each.category != "pedestrian" for each in local.users], dtype=np.bool_)[user]
    if not drives.any() or not geometry.roads:
        return 1.0
    x, y = local.position[:, 0], local.position[:, 1]
    extent = shapely.MultiPoint(joined(geometry.roads)[:, :, :2].reshape(-1, 2)).envelope
    areas = (geometry.region.convex_hull, extent)
    within = (np.flatnonzero(drives & shapely.contains_xy(area, x, y)) for area in areas)
    near = next((samples for samples in within if len(samples)), None)
    if near is None:
        return 0.0
    sample = local.position[near[np.linspace(0, len(near) - 1, min(len(near), MAX_SAMPLES)).astype(np.int64)]]
    height = RoadSurface(joined(geometry.roads)).height(sample[:, :2], sample[:, 2])
    return float(np.mean(np.abs(height - sample[:, 2]) <= ROAD_TOLERANCE))


def check_runs(runs: Sequence[Trajectories], region: BaseGeometry) -> None:
    """Raise SeipError if a run has no road user in the region of interest: it then belongs to another site."""
    for run in runs:
        if not shapely.contains_xy(region, run.position[:, 0], run.position[:, 1]).any():
            raise SeipError(
                f"no road user of {run.description} is ever in the region of interest: use traffic of this site, or "
                "set the scene's seip_origin to that of its map"
            )
