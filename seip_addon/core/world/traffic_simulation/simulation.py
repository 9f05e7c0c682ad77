"""Traffic from SUMO (Simulation of Urban MObility, Eclipse) on a map; SUMO itself is an optional extra."""

import shutil
import tempfile
from collections.abc import Generator, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely

from ...base.arrays import Float
from ...base.errors import SeipError
from ...base.progress import Progress
from ...programs.sumo_programs import NETWORK_SUFFIX, Sumo, find_sumo, run
from ...sensing.traffic.floating_car_data import Extent
from ...sensing.traffic.overlaps import without_overlaps
from ...sensing.traffic.road_fit import fit_to_road, smooth_walks
from ...sensing.traffic.source import ROAD_MARGIN, TrafficFiles, read_sumo, road_bounds
from ...sensing.traffic.trajectories import Trajectories
from ...site.scene_geometry import SceneGeometry
from ...storage.files import whole_file
from ..opendrive.read import read_map
from ..opendrive.road_map import RoadMap
from ..streetscape.road_surface import GROUPS
from .demand import Demand, write_routes
from .street_network import PARKED_CLASS, StreetNetwork, read_network

STEP_SECONDS = 0.1  # seconds between two steps of the simulation
MIN_LANE_WIDTH = 1.0  # metres
SAMPLING_SECONDS = 0.2  # seconds between two samples of the trajectories
_LANE_CHANGE_SECONDS = 4.0  # seconds; without it SUMO's vehicles jump from lane to lane
_MAX_SIGNAL_DISTANCE = 60.0  # metres, largest distance of a crosswalk from its traffic light
_PAVEMENT_REACH = 6.0  # metres that pavements extend beyond the ends of a crosswalk

_PERMISSIONS = {
    "driving": 'disallow="pedestrian"',
    "sidewalk": 'allow="pedestrian"',
    "biking": 'allow="bicycle"',
    "parking": f'allow="{PARKED_CLASS}"',
}
"""Permissions of groups of lane types; all others are closed explicitly: SUMO opens types without any to all."""
_OWN_PERMISSIONS = {"bus": 'allow="bus"', "taxi": 'allow="taxi bus"'}
_LANES = {lane: _PERMISSIONS.get(group, 'disallow="all"') for lane, group in GROUPS.items()} | _OWN_PERMISSIONS
"""Permissions of all lane types of OpenDRIVE that have a surface."""


@dataclass(frozen=True)
class SignalPlan:
    """Fixed plan of every traffic light, with green for opposite arms together; seconds of each state."""

    green: int = 25
    amber: int = 3
    all_red: int = 2

    def __post_init__(self) -> None:
        if min(self.green, self.amber) < 1 or self.all_red < 0:
            raise SeipError("a signal plan needs green and amber of at least 1 s, and no negative times")


@dataclass(frozen=True)
class Scenario:
    """Seed, duration, demand and signals of a simulation.

    Parameters
    ----------
    seed : int
        Seed of all randomness, here and in SUMO.
    duration : float, seconds
    """

    demand: Demand
    signals: SignalPlan
    seed: int
    duration: float

    def __post_init__(self) -> None:
        if not 0 <= self.seed < 2**31:
            raise SeipError(f"--seed must be a whole number from 0 to {2**31 - 1}, not {self.seed}")
        if not 0.0 < self.duration <= 86400.0:
            raise SeipError(f"a simulation must last above 0 s and at most a day, not {self.duration:g} s")


@dataclass(frozen=True, eq=False)
class SimulatedRun:
    """A run of traffic: its trajectories from time 0 on, with notes on its simulation.

    Parameters
    ----------
    simulated : int
        Number of road users, including those removed because they overlapped others.
    collided : tuple of str
        Names of the removed road users.
    warnings : tuple of str
    """

    trajectories: Trajectories
    simulated: int
    collided: tuple[str, ...]
    warnings: tuple[str, ...]


def simulate_run(
    map_path: Path, scenario: Scenario, warm_up: float, geometry: SceneGeometry, sumo: Iterable[Path] = ()
) -> Generator[Progress, None, SimulatedRun]:
    """Simulate traffic on a scene's map and fit it to the road of the scene.

    Parameters
    ----------
    scenario : Scenario
        Its duration includes the warm-up.
    warm_up : float, seconds
        Simulated time before the run begins.
    sumo : iterable of Path
        Folders to search for SUMO first, as in `find_sumo`.

    Raises
    ------
    SeipError
        SUMO is missing or rejects the map, or there are no road users on the road.
    """
    demand = scenario.demand
    with tempfile.TemporaryDirectory() as folder:
        files = yield from simulate(map_path, Path(folder), scenario, road_bounds(geometry, 0.0), sumo)
        source = f"SUMO on {map_path.name}, {demand.flow:g} vehicles per hour and arm, seed {scenario.seed}"
        return (yield from recorded_run(files, (warm_up, scenario.duration), geometry, source))


def recorded_run(
    files: TrafficFiles, span: tuple[float, float], geometry: SceneGeometry, source: str
) -> Generator[Progress, None, SimulatedRun]:
    """Read trajectories recorded by SUMO and fit them to the road of a scene.

    Parameters
    ----------
    span : (float, float), seconds
        Begin and end of the run in the simulation.
    source : str
        Source of the trajectories, for messages.

    Raises
    ------
    SeipError
        There are no road users on the road.
    """
    read = yield from read_sumo(files, Extent(*span, road_bounds(geometry, ROAD_MARGIN)), geometry, source)
    fit = fit_to_road(smooth_walks(read.trajectories), geometry)
    apart, collided = yield from without_overlaps(fit.trajectories)
    return SimulatedRun(
        trajectories=replace(apart, time=np.round(apart.time - span[0], 3)),
        simulated=len(fit.trajectories),
        collided=collided,
        warnings=(*read.warnings, *fit.warnings),
    )


def simulate(
    map_path: Path,
    folder: Path,
    scenario: Scenario,
    bounds: tuple[float, float, float, float] | None = None,
    sumo: Iterable[Path] = (),
) -> Generator[Progress, None, TrafficFiles]:
    """Simulate traffic on a map from 0 to the scenario's duration.

    Parameters
    ----------
    map_path : Path
        OpenDRIVE map, or network of SUMO (.net.xml).
    bounds : (4,) float, metres, optional
        Rectangle of the map (left, bottom, right, top); only roads that reach into it are used.
    sumo : iterable of Path
        Folders to search for SUMO first, as in `find_sumo`.

    Returns
    -------
    TrafficFiles
        Files, identical for the same arguments except for the dates in SUMO's comments.

    Raises
    ------
    SeipError
        SUMO is missing or rejects its input, or the map has no road that leads in.
    """
    programs = find_sumo(sumo)
    recorded, routes, network = (folder / f"traffic.{kind}.xml" for kind in ("fcd", "rou", "net"))
    yield from _network(programs, map_path, network, scenario.signals, bounds)
    write_routes(routes, read_network(network), scenario.demand, scenario.seed, scenario.duration)
    files = TrafficFiles(recorded, (routes,), network)
    yield from run_sumo(programs, files, scenario.seed, scenario.duration)
    return files


def run_sumo(programs: Sumo, files: TrafficFiles, seed: int, duration: float) -> Generator[Progress, None, None]:
    """Simulate the vehicles of route files on their network from 0 to ``duration`` seconds.

    Parameters
    ----------
    files : TrafficFiles
        The network, the routes, and the floating car data to be written, in one folder.

    Raises
    ------
    SeipError
        SUMO rejects its input.
    """
    yield from run(
        programs,
        programs.sumo,
        [
            *("--net-file", files.net, "--route-files", ",".join(path.name for path in files.routes)),
            *("--fcd-output", files.path, "--seed", seed),
            *("--end", duration, "--step-length", STEP_SECONDS, "--precision", 3),
            *("--device.fcd.period", SAMPLING_SECONDS, "--person-device.fcd.period", SAMPLING_SECONDS),
            *("--lanechange.duration", _LANE_CHANGE_SECONDS, "--time-to-teleport", -1),
            *("--collision.action", "warn", "--collision.check-junctions", "true", "--ignore-route-errors", "true"),
            *("--no-step-log", "true", "--no-warnings", "true", "--xml-validation", "never"),
        ],
        "simulating traffic",
        files.path.parent,
    )


def _network(
    programs: Sumo, map_path: Path, network: Path, signals: SignalPlan, bounds: tuple[float, float, float, float] | None
) -> Generator[Progress, None, None]:
    """Write the network of a map: driving lanes, pavements, crossings where there are traffic lights, parking lanes.

    The network of an extract has crossings already; that of an OpenDRIVE map gets them here.
    """
    folder = network.parent
    plain, nodes = (folder / name for name in ("plain.net.xml", "shapes.nod.xml"))
    common: list[object] = [
        *("--offset.disable-normalization", "true", "--no-turnarounds", "true", "--xml-validation", "never"),
        *("--junctions.internal-link-detail", 20, "--no-warnings", "true", "--tls.default-type", "static"),
        *("--tls.green.time", signals.green, "--tls.yellow.time", signals.amber, "--tls.allred.time", signals.all_red),
    ]
    shapes: dict[str, Float] = {}
    if map_path.name.endswith(NETWORK_SUFFIX):
        _copy(map_path, plain)
        whole = read_network(map_path)
    else:
        common += ["--crossings.guess", "true", "--crossings.guess.speed-threshold", 0]
        yield from _import_opendrive(programs, map_path, plain, common)
        whole = read_network(plain)
        shapes = _junction_shapes(whole, read_map(map_path))
    if bounds is not None:
        if not _reaches_into(whole, bounds):
            raise SeipError(f"{map_path.name} has no road at this site: name the map that the site was built from")
        cut = folder / "cut.net.xml"
        clip = [
            "--keep-edges.in-boundary=" + ",".join(f"{edge:.3f}" for edge in bounds),
            "--keep-edges.postload",
            "true",
        ]
        source = ["--sumo-net-file", plain, "--tls.rebuild", "true", "--output-file", cut]
        yield from run(programs, programs.netconvert, [*source, *common, *clip], "cutting the map", folder)
        complete = _complete_junctions(whole, read_network(cut))
        shapes = {node: shape for node, shape in shapes.items() if node in complete}
        plain = cut
    corners = {node: " ".join(f"{x:.2f},{y:.2f}" for x, y in shape) for node, shape in shapes.items()}
    _write(nodes, "nodes", [f'<node id="{node}" shape="{shape}"/>' for node, shape in corners.items()])
    source = ["--sumo-net-file", plain, "--node-files", nodes, "--tls.rebuild", "true", "--output-file", network]
    yield from run(programs, programs.netconvert, [*source, *common], "laying crosswalks", folder)


def _import_opendrive(
    programs: Sumo, map_path: Path, plain: Path, common: Sequence[object]
) -> Generator[Progress, None, None]:
    """Convert an OpenDRIVE map to a network."""
    types, source = plain.with_name("lanes.typ.xml"), plain.with_name("map.xodr")
    _copy(map_path, source)
    allowed = _LANES | {"none": 'disallow="all"'}
    _write(types, "types", [f'<type id="{lane}" speed="13.89" {who}/>' for lane, who in allowed.items()])
    # netconvert closes lanes below a least width, such as the two halves of one lane for both directions.
    narrow = ["--opendrive.min-width", MIN_LANE_WIDTH, "--opendrive.import-all-lanes", "true"]
    lanes = [*narrow, "--type-files", types, "--tls.guess", "true"]
    files = ["--opendrive-files", source, *lanes, "--output-file", plain]
    yield from run(programs, programs.netconvert, [*files, *common], "reading the map", plain.parent)


def _copy(map_path: Path, to: Path) -> None:
    """Copy a map to where SUMO can read it, whatever its path."""
    try:
        shutil.copyfile(map_path, to)
    except OSError as error:
        raise SeipError(f"cannot read the map {map_path} ({error.strerror}); check its path") from error


def _junction_shapes(network: StreetNetwork, road_map: RoadMap) -> dict[str, Float]:
    """Return an outline (k, 2) around the crosswalks of each signalised junction.

    SUMO places crossings along the inside of a junction and stops vehicles at its edge. With these outlines, both are
    where the map has them.
    """
    if not network.signalised:
        return {}
    nodes = list(network.signalised)
    places = np.array(list(network.signalised.values()))
    corners: dict[str, list[Float]] = {}
    for crosswalk in _crosswalks(road_map):
        distance = np.hypot(*(places - crosswalk.mean(axis=0)).T)
        if distance.min() < _MAX_SIGNAL_DISTANCE:
            corners.setdefault(nodes[int(distance.argmin())], []).append(crosswalk)
    hulls = {node: shapely.MultiPoint(np.concatenate(parts)).convex_hull for node, parts in corners.items()}
    return {node: shapely.get_coordinates(hull)[:-1] for node, hull in hulls.items()}


def _reaches_into(network: StreetNetwork, bounds: tuple[float, float, float, float]) -> bool:
    """Return whether a lane of a network reaches into a rectangle."""
    kept = shapely.box(*bounds)
    lanes = (lane for edge in network.edges.values() for lane in edge.lanes)
    return any(shapely.LineString(lane.line).intersects(kept) for lane in lanes)


def _complete_junctions(whole: StreetNetwork, cut: StreetNetwork) -> set[str]:
    """Return the signalised nodes of a network that was cut to which all edges of the whole network still lead."""
    return set(cut.signalised) - {edge.to_node for edge in whole.edges.values() if edge.id not in cut.edges}


def _crosswalks(road_map: RoadMap) -> list[Float]:
    """Return the corners (4, 2) of the crosswalks of a map, in plan, with the pavements at their ends."""
    outlines = []
    for one in road_map.objects:
        if one.kind == "crosswalk" and one.length > 0.0 and one.width > 0.0:
            ahead = np.array([np.cos(one.yaw), np.sin(one.yaw)]) * one.length / 2.0
            aside = np.array([-np.sin(one.yaw), np.cos(one.yaw)]) * (one.width / 2.0 + _PAVEMENT_REACH)
            signs = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
            outlines.append(one.position[:2] + signs @ np.stack([ahead, aside]))
    return outlines


def _write(path: Path, root: str, elements: Sequence[str]) -> None:
    with whole_file(path) as temporary:
        temporary.write_text("\n".join([f"<{root}>", *elements, f"</{root}>", ""]), encoding="utf-8")
