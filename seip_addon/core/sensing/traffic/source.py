"""Traffic for a scene from a user's files: trajectories, or SUMO's floating car data fitted to the road."""

import math
import os
from collections import Counter
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.arrays import Float
from ...base.counts import counted
from ...base.errors import SeipError
from ...base.limits import MAP_COORDINATE
from ...base.progress import Progress
from ...site.scene_geometry import SceneGeometry, joined
from ...storage.xml_stream import Attributes, read_tags
from .floating_car_data import Extent, read_floating_car_data
from .road_fit import fit_to_road
from .site_traffic import load_trajectories
from .trajectories import CATEGORIES, LoadedTraffic, Trajectories
from .vehicle_types import read_vehicle_types

ROAD_MARGIN = 20.0  # metres beyond the road of the scene within which traffic is read
_PLURAL = {"bus": "buses"}  # of categories, where it does not just add an "s"


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
    start, duration : float, seconds, optional
        Time span of floating car data to read; by default all.
    """

    path: Path
    routes: tuple[Path, ...] = ()
    net: Path | None = None
    start: float | None = None
    duration: float | None = None

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
    window = Extent(
        begin=-math.inf if files.start is None else files.start,
        bounds=road_bounds(geometry, ROAD_MARGIN),
        duration=math.inf if files.duration is None else files.duration,
    )
    read = yield from read_sumo(files, window, geometry, files.path.name)
    fit = fit_to_road(read.trajectories, geometry)
    return LoadedTraffic(fit.trajectories, (*read.warnings, *fit.warnings))


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
    types = yield from read_vehicle_types(files.routes)
    return (yield from read_floating_car_data(files.path, types, geometry.origin, source, offset, window))


def road_bounds(geometry: SceneGeometry, margin: float) -> tuple[float, float, float, float]:
    """Return the bounding rectangle of the scene's road with a margin in metres, in map coordinates."""
    road = joined(geometry.roads)[:, :, :2].reshape(-1, 2) + geometry.origin[:2]
    (left, low), (right, high) = road.min(axis=0) - margin, road.max(axis=0) + margin
    return float(left), float(low), float(right), float(high)


def describe_categories(trajectories: Trajectories) -> str:
    """Return the number of road users of each category, as text."""
    counts = Counter(user.category for user in trajectories.users)
    return ", ".join(counted(counts[one], one, _PLURAL.get(one, "")) for one in CATEGORIES if counts[one])


def read_net_offset(path: str | os.PathLike[str]) -> Float:
    """Return the offset (2,) in metres of a SUMO network: its coordinates are the map's plus this.

    Raises
    ------
    SeipError
        The file cannot be read, or is not a SUMO network.
    """
    found: list[str] = []

    def take(tag: str, attributes: Attributes) -> None:
        if tag == "location":
            found.append(attributes.get("netOffset", ""))

    for _ in read_tags(path, take):
        if found:
            break
    try:
        x, y = (float(number) for number in found[0].split(","))
    except (IndexError, ValueError) as error:
        raise SeipError(f"{Path(path).name} is not a SUMO network: it has no netOffset; name a .net.xml") from error
    MAP_COORDINATE.require([x, y], Path(path).name, "netOffset", "name a .net.xml that netconvert wrote")
    return np.array([x, y])
