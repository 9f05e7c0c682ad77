"""Traffic for a scene from a user's files: trajectories, or SUMO's floating car data fitted to the road."""

import math
from collections import Counter
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...counts import counted
from ...errors import SeipError
from ...progress import Progress
from ...site.scene_geometry import SceneGeometry, joined
from .floating_car_data import Extent, read_floating_car_data, read_trajectories
from .overlaps import find_overlaps
from .road_fit import fit_to_road, share_on_road
from .sumo_files import read_net_offset
from .trajectories import CATEGORIES, LoadedTraffic, Trajectories
from .vehicle_types import read_vehicle_types

MAX_REGION_DISTANCE = 500.0  # metres from the region beyond which traffic belongs to another site
MIN_ON_ROAD = 0.98  # share of vehicle positions on the road below which traffic belongs to another site
ROAD_MARGIN = 20.0  # metres beyond the road of the scene within which traffic is read
OVERLAP_INTERVAL = 1.0  # seconds between the instants that are searched for overlapping road users


@dataclass(frozen=True)
class TrafficFiles:
    """Files of traffic.

    Parameters
    ----------
    path : path
        Trajectories (``.npz``), or floating car data of SUMO.
    routes : tuple of path
        Files with the vehicle types, for floating car data.
    net : path, optional
        The ``.net.xml``, which contains the offset from the map.
    begin, end : float, seconds
        Time span of floating car data to read.
    """

    path: Path
    routes: tuple[Path, ...] = ()
    net: Path | None = None
    begin: float = -math.inf
    end: float = math.inf

    @property
    def trajectories(self) -> bool:
        """Whether the files are trajectories already."""
        return self.path.suffix.lower() == ".npz"


def load_traffic(files: TrafficFiles, geometry: SceneGeometry) -> Generator[Progress, None, LoadedTraffic]:
    """Read traffic for a scene.

    Raises
    ------
    SeipError
        A file cannot be read, or belongs to another site.
    """
    if files.trajectories:
        yield Progress(0, 0, "trajectories")
        return LoadedTraffic(load_trajectories(files.path, geometry), ())
    window = Extent(files.begin, files.end, road_bounds(geometry, ROAD_MARGIN))
    read = yield from read_sumo(files, window, geometry, files.path.name)
    fit = fit_to_road(read.trajectories, geometry)
    overlaps = yield from overlap_warnings(fit.trajectories)
    return LoadedTraffic(fit.trajectories, (*read.warnings, *fit.warnings, *overlaps))


def load_trajectories(path: Path, geometry: SceneGeometry) -> Trajectories:
    """Read trajectories into a scene's axes.

    Raises
    ------
    SeipError
        The file cannot be read, no road user in it comes near, or it is traffic of another site.
    """
    trajectories = Trajectories.load(path).moved_to(geometry.origin)
    left, bottom, right, top = geometry.region.bounds
    low, high = np.array([left, bottom]) - MAX_REGION_DISTANCE, np.array([right, top]) + MAX_REGION_DISTANCE
    plan = trajectories.position[:, :2]
    if not ((plan >= low) & (plan <= high)).all(axis=1).any():
        raise SeipError(
            f"{path} is traffic of another place, far from this scene: name traffic that was made for its map"
        )
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
    share = share_on_road(trajectories, geometry)
    if share < MIN_ON_ROAD:
        raise SeipError(
            f"traffic of another site: {1 - share:.0%} of the vehicle positions of {name} are off the road of this "
            "scene; import or simulate traffic for it"
        )


def read_sumo(
    files: TrafficFiles, window: Extent, geometry: SceneGeometry, source: str
) -> Generator[Progress, None, LoadedTraffic]:
    """Read floating car data with the sizes of its vehicles, without fitting it to the road.

    Parameters
    ----------
    geometry : SceneGeometry
        Geometry of the scene, for its origin and its map's header; SUMO includes the header's offset in the network's.
    source : str
        Source of the trajectories, for messages.
    """
    offset = (
        None if files.net is None else read_net_offset(files.net) + np.array(geometry.geo_reference.header_offset[:2])
    )
    data = yield from read_floating_car_data(files.path, offset, window)
    types = yield from read_vehicle_types(files.routes)
    return LoadedTraffic(*read_trajectories(data, types, geometry.origin, source))


def overlap_warnings(trajectories: Trajectories) -> Generator[Progress, None, tuple[str, ...]]:
    """Return a warning if road users overlap."""
    overlaps = yield from find_overlaps(trajectories, OVERLAP_INTERVAL)
    if not len(overlaps):
        return ()
    worst = int(overlaps.area.argmax())
    one, other = (trajectories.users[number].name for number in overlaps.pair[worst])
    pairs = counted(len(overlaps), "pair of road users overlaps", "pairs of road users overlap")
    return (f"{pairs}; {one} and {other} share {overlaps.area[worst]:.1f} m² at {overlaps.time[worst]:g} s",)


def road_bounds(geometry: SceneGeometry, margin: float) -> tuple[float, float, float, float]:
    """Return the bounding rectangle of the scene's road with a margin in metres, in map coordinates."""
    road = joined(geometry.roads)[:, :, :2].reshape(-1, 2) + geometry.origin[:2]
    (left, low), (right, high) = road.min(axis=0) - margin, road.max(axis=0) + margin
    return float(left), float(low), float(right), float(high)


def describe_categories(trajectories: Trajectories) -> str:
    """Return the number of road users of each category, as text."""
    counts = Counter(user.category for user in trajectories.users)
    return ", ".join(f"{counts[category]} {category}" for category in CATEGORIES if counts[category])
