"""Runs of traffic with the demand of a user's route file, drawn randomly for each."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from pathlib import Path

from headless.studies.paper.route_file import RouteDemand, read_demand, write_run

import numpy as np
import shapely

from seip_addon.core.base.arrays import Float
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Progress, within
from seip_addon.core.programs.sumo_programs import find_sumo
from seip_addon.core.sensing.traffic.run_overlap import VehiclePositions, overlap_of, vehicle_positions
from seip_addon.core.sensing.traffic.source import TrafficFiles, read_net_offset
from seip_addon.core.sensing.traffic.trajectories import Trajectories
from seip_addon.core.site.scene_geometry import SceneGeometry, joined
from seip_addon.core.workflows.traffic_runs import traffic_folder
from seip_addon.core.world.traffic_simulation.simulation import recorded_run, run_sumo
from seip_addon.core.world.traffic_simulation.street_network import DRIVING, StreetNetwork, read_network

MIN_ON_ROAD = 0.8  # least share of a network's lanes in the region on the scene's road, for a network of its map
WARM_UP = 120.0  # seconds before a run begins
SIGNAL_CYCLE = 120  # seconds; the start of a drawn run is random within it, so that the phases of signals differ
MOST_OVERLAP = 0.16
"""Largest overlap of a drawn run with an earlier one: the largest of any two runs at the shipped junction."""

MAX_DRAWS = 40  # draws of a run until the overlap is small enough; then the one with the least overlap is taken
_ROAD_TOLERANCE = 1.0  # metres from a lane's middle to the road
_SAMPLING = 2.0  # metres between points of a lane


@dataclass(frozen=True)
class TrafficSource:
    """The user's files of traffic: routes, vehicle types, and the network that the routes are on."""

    routes: Path
    types: tuple[Path, ...]
    network: Path


def read_demand_of_site(
    source: TrafficSource, geometry: SceneGeometry, map_name: str
) -> Generator[Progress, None, RouteDemand]:
    """Read the demand, and check that it is of this site.

    Raises
    ------
    SeipError
        A file cannot be read, the network is of another map, or no flow goes through the region.
    """
    demand = yield from read_demand(source.routes, source.types)
    offset = read_net_offset(source.network) + np.array(geometry.geo_reference.header_offset[:2])
    network = read_network(source.network)
    shift = offset + geometry.origin[:2]
    share = _share_on_road(network, geometry, shift)
    if share is None or share < MIN_ON_ROAD:
        found = "none of its streets is there" if share is None else f"{share:.0%} of its lanes there are on the road"
        raise SeipError(
            f"{source.network.name} is not a network of the map {map_name} at this site ({found}): name the .net.xml "
            "that was made from the map"
        )
    for flow in demand.flows:
        unknown = [edge for edge in flow.edges if edge not in network.edges]
        if unknown:
            raise SeipError(
                f"{source.routes.name}: flow {flow.name!r} takes the edge {unknown[0]!r}, which "
                f"{source.network.name} does not have: name the network that the routes were made for"
            )
    if not any(_crosses(flow.edges, network, geometry, shift) for flow in demand.flows):
        raise SeipError(
            f"no flow of {source.routes.name} goes through the region of {geometry.name}: name routes through its "
            "junction, or another --junction"
        )
    return demand


def _share_on_road(network: StreetNetwork, geometry: SceneGeometry, shift: Float) -> float | None:
    """Return the share of the network's driving lanes in the region that is on the road; None without any."""
    lines = [lane.line - shift for edge in network.edges.values() for lane in edge.lanes_for(DRIVING)]
    near = [one for one in map(shapely.LineString, lines) if one.intersects(geometry.region)]
    parts = [shapely.segmentize(one, _SAMPLING) for one in near]
    points = np.concatenate([np.empty((0, 2)), *map(shapely.get_coordinates, parts)])
    points = points[shapely.contains_xy(geometry.region, points[:, 0], points[:, 1])]
    if not len(points):
        return None
    road = shapely.union_all(shapely.polygons(joined(geometry.roads)[:, :, :2]))
    shapely.prepare(road)
    return float(np.mean(shapely.dwithin(road, shapely.points(points), _ROAD_TOLERANCE)))


def _crosses(edges: Sequence[str], network: StreetNetwork, geometry: SceneGeometry, shift: Float) -> bool:
    """Return whether a route passes from one street to the next within the region."""
    ends = [network.edges[edge].lanes[-1].line[-1] - shift for edge, _ in pairwise(edges)]
    return any(shapely.contains_xy(geometry.region, *end) for end in ends)


def make_runs(  # inputs and sizes of the runs
    scene: Path, source: TrafficSource, demand: RouteDemand, geometry: SceneGeometry, runs: int, duration: float
) -> Generator[Progress, None, list[Path]]:
    """Simulate runs into the folder next to a scene's file.

    A run is simulated again with other seeds while it overlaps an earlier one by more than `MOST_OVERLAP`.

    Parameters
    ----------
    runs : int
        Number of runs.
    duration : float, seconds
        Duration of each run.

    Returns
    -------
    list of Path
        Files ``run-N.npz``, in the order of their numbers.

    Raises
    ------
    SeipError
        SUMO is missing or rejects its input, or there are no road users on the road.
    """
    folder = traffic_folder(scene)
    folder.mkdir(parents=True, exist_ok=True)
    earlier: list[VehiclePositions] = []
    paths = [folder / f"run-{number}.npz" for number in range(1, runs + 1)]
    for number, path in enumerate(paths, start=1):
        progress = Progress(number - 1, runs, f"run {number}")
        drawn: list[tuple[float, int, Trajectories, VehiclePositions]] = []
        for draw in range(MAX_DRAWS):
            seed = MAX_DRAWS * number + draw
            run = yield from within(progress, _simulated(folder, source, demand, geometry, seed, duration))
            own = vehicle_positions(path.stem, run)
            overlap = max((overlap_of(own, other) or 0.0 for other in earlier), default=0.0)
            drawn.append((overlap, draw, run, own))
            if overlap <= MOST_OVERLAP:
                break
        *_, run, own = min(drawn)
        run.save(path)
        earlier.append(own)
    return paths


def _simulated(  # as above
    folder: Path, source: TrafficSource, demand: RouteDemand, geometry: SceneGeometry, seed: int, duration: float
) -> Generator[Progress, None, Trajectories]:
    begin = WARM_UP + float(np.random.default_rng([seed, 5]).integers(SIGNAL_CYCLE))
    end = begin + duration
    routes, recorded = folder / "run.rou.xml", folder / "run.fcd.xml"
    files = TrafficFiles(recorded, (routes,), source.network)
    try:
        write_run(routes, demand, seed, end)
        yield from run_sumo(find_sumo(), files, seed, end)
        origin = f"SUMO, demand of {source.routes.name}, seed {seed}"
        run = yield from recorded_run(files, (begin, end), geometry, origin)
    finally:
        for path in (routes, recorded):
            path.unlink(missing_ok=True)
    return run.trajectories


def overlaps(paths: Sequence[Path]) -> tuple[float, ...]:
    """Return the overlaps of all pairs of runs, in ascending order; see `overlap_of`."""
    positions = [vehicle_positions(path.stem, Trajectories.load(path)) for path in paths]
    shares = (overlap_of(*pair) for pair in combinations(positions, 2))
    return tuple(sorted(share for share in shares if share is not None))
