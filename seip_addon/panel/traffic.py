"""Traffic: trajectories read from files, animated in the scene, or simulated with SUMO on the map of the site."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import bpy
from bpy.props import BoolProperty, IntProperty, StringProperty

from ..core.base.counts import counted
from ..core.base.errors import SeipError
from ..core.base.progress import Progress
from ..core.programs.sumo_programs import NETWORK_SUFFIX
from ..core.sensing.scans.simulation import ScanSettings
from ..core.sensing.traffic.source import TrafficFiles, describe_categories, load_traffic
from ..core.sensing.traffic.trajectories import Trajectories
from ..core.workflows.traffic_simulation import DEFAULT_RUNS, SimulatedRuns, SimulationSettings, simulate_runs
from ..core.world.openstreetmap.site import is_extract
from ..core.world.traffic_simulation.demand import Demand
from ..scene import contract
from ..scene.read import read_scene
from ..scene.traffic import animate, clear_traffic
from . import preferences, scans, scene_status
from .layout import draw_path, draw_reason, draw_run, draw_sentence, draw_settings
from .properties import absolute, as_typed, of_setting, path_property, saved_path
from .work import Job, LongWork, ShortWork

EXAMPLE = "Example"
"""In place of a traffic file: the traffic of the example, which is at another path on every machine."""
EXAMPLES = Path(__file__).resolve().parents[2] / "scenes"
"""Folder of the example: beside the package, in a checkout as in the extension."""
EXAMPLE_RUN, EXAMPLE_MAP = EXAMPLES / "junction_traffic" / "run-1.npz", EXAMPLES / "junction.xodr"
EXAMPLE_SITE = EXAMPLES / "junction.toml"
NO_FILE = "There is no traffic file: name one, or animate objects of your own in SEIP Traffic."
_MOST_SECONDS = 3600.0
NO_MAP = "There is no map to simulate traffic on: name the OpenDRIVE map (.xodr) that this site was built from."
USED = "Detection and placements in traffic use these runs."


class SEIP_PG_traffic(bpy.types.PropertyGroup):
    """Source of the traffic, and settings of its scans."""

    file: path_property(
        "Traffic",
        "Trajectories (.npz) or floating car data of SUMO (.xml, packed or not); "
        f"{EXAMPLE} for the traffic of the example; empty for objects that are animated in the scene",
    )
    routes: path_property("Routes", "SUMO file with the vehicle types and their sizes")
    net: path_property("Network", "SUMO network (.net.xml) with the offset from the map")
    runs: path_property(
        "Runs",
        "Folder with runs of traffic (.npz): two or more to place sensors in traffic, of which the last third is for "
        "evaluation, and four or more for an interval of detection. Empty for the folder SCENE_traffic beside the file",
        folder=True,
    )
    loaded: StringProperty(name="Loaded", description="Content of the file, one fact a line")
    seed: of_setting(ScanSettings, "seed", "Seed")
    noise: BoolProperty(
        name="Noise", description="Noisy ranges and lost returns, as in the sensors' data sheets", default=True
    )
    rolling_shutter: of_setting(ScanSettings, "rolling_shutter", "Rolling Shutter")

    def files(self) -> TrafficFiles | None:
        """Return the files that traffic is read from, None where it is animated in the scene."""
        if not self.file:
            return None
        if self.file == EXAMPLE:
            return TrafficFiles(EXAMPLE_RUN)
        routes = (absolute(self.routes),) if self.routes else ()
        return TrafficFiles(absolute(self.file), routes, absolute(self.net) if self.net else None)

    def scan(self) -> ScanSettings:
        """Return the settings of scans as the core takes them."""
        return ScanSettings(self.seed, self.noise, self.rolling_shutter)


def why_no_load(scene: bpy.types.Scene) -> str:
    """Return why no traffic can be loaded; nothing where it can."""
    return scene_status.not_own(scene) or ("" if scene.seip.traffic.file else NO_FILE)


class SEIP_OT_load_traffic(LongWork, bpy.types.Operator):
    """Read the traffic file and animate its road users on the road"""

    obstacles = (why_no_load,)

    def job(self, scene: bpy.types.Scene) -> Job:
        """Read the traffic onto the scene, and animate its road users."""
        scene, result = yield load_traffic(scene.seip.traffic.files(), read_scene(scene).geometry)
        show_traffic(scene, result.trajectories, result.warnings)
        self.warn(result.warnings)
        self.report({"INFO"}, f"{counted(len(result.trajectories), 'road user')}; press play")


def show_traffic(scene: bpy.types.Scene, trajectories: Trajectories, warnings: Sequence[str]) -> None:
    """Animate road users read from files, in place of earlier ones and of their scan, and note what there is."""
    animate(scene, trajectories)
    scans.forget_scan(scene)
    begin, end = trajectories.span
    users = f"{counted(len(trajectories), 'road user')}, {begin:g} to {end:g} s"
    scene.seip.traffic.loaded = "\n".join((users, describe_categories(trajectories), *warnings))


class SEIP_OT_clear_traffic(ShortWork, bpy.types.Operator):
    """Remove the loaded road users from the scene; your own objects stay"""

    bl_options = {"REGISTER", "UNDO"}

    obstacles = (lambda scene: "" if contract.find(scene, contract.TRAFFIC) else "there is no traffic in the scene",)

    def act(self, context: bpy.types.Context) -> None:
        """Take it out."""
        scene = context.scene
        clear_traffic(scene)
        scans.forget_scan(scene)
        scene.seip.traffic.loaded = ""


class SEIP_PG_simulation(bpy.types.PropertyGroup):
    """Settings of the simulation of traffic, and what was simulated last."""

    map: path_property(
        "Map",
        "Map of the site, on which SUMO simulates traffic: OpenDRIVE (.xodr) or a network of SUMO "
        "(.net.xml), as a file, or a text in this file such as the streets of an extract; "
        f"{EXAMPLE} for that of the example. Empty for the map beside the file",
    )
    flow: of_setting(Demand, "flow", "Vehicles/h", min=1.0, soft_max=1200.0, step=5000, precision=0)
    pedestrians: of_setting(Demand, "pedestrians", "Pedestrians/h", soft_max=1200.0, step=5000, precision=0)
    duration: of_setting(
        SimulationSettings, "duration", "Duration (s)", min=1.0, max=_MOST_SECONDS, step=1000, precision=0
    )
    count: IntProperty(
        name="Runs",
        description="Number of runs, each with a seed of its own. An interval of the average precision needs four, a "
        "placement in traffic two; more give closer figures",
        default=DEFAULT_RUNS,
        min=1,
        soft_max=16,
        max=1000,
    )
    folder: path_property(
        "Folder", "Folder for the runs only; // is the folder of the .blend", folder=True, default="//seip-traffic/"
    )
    facts: StringProperty(name="Simulated", description="Summary of the last simulation")

    def street_map(self) -> Path | bpy.types.Text | None:
        """Return the map that traffic is simulated on: a file, which may not exist, a text, or None."""
        if self.map == EXAMPLE:
            return EXAMPLE_MAP
        if self.map:
            return bpy.data.texts.get(self.map) or absolute(self.map)
        name, file = str(self.id_data.get(contract.MAP, "")), Path(bpy.data.filepath)
        if not name or not bpy.data.filepath:
            return None
        # `seip build-scene` writes the map of an extract's streets beside the scene, under the name of the scene
        path = file.with_suffix(NETWORK_SUFFIX) if is_extract(Path(name)) else file.with_name(name)
        return path if path.is_file() else None

    def settings(self) -> SimulationSettings:
        """Return the settings of the runs as the core takes them."""
        demand = Demand(flow=as_typed(self.flow), pedestrians=as_typed(self.pedestrians))
        return SimulationSettings(demand, duration=as_typed(self.duration))


def why_no_simulation(scene: bpy.types.Scene) -> str:
    """Return why no traffic can be simulated; nothing where it can."""
    obstacle = scene_status.obstacle(scene)
    if obstacle:
        return obstacle
    if preferences.sumo() is None:
        return f"{preferences.NO_SUMO}."
    return "" if scene.seip.simulation.street_map() is not None else NO_MAP


class SEIP_OT_simulate_traffic(LongWork, bpy.types.Operator):
    """Simulate runs of traffic on the map of the site with SUMO, put the first on the road, and use all for Detection and for placements in traffic"""  # noqa: E501  # a tooltip is one line

    stopped_message = "stopped; no run was written"

    obstacles = (why_no_simulation,)

    def job(self, scene: bpy.types.Scene) -> Job:
        """Simulate on the road and the map, show the first run, and name the folder where runs are asked for."""
        request = scene.seip.simulation
        found = request.street_map()
        if found is None:
            raise SeipError(NO_MAP)
        named = request.folder
        geometry = read_scene(scene).geometry
        more = (request.settings(), request.count, geometry, saved_path(request.folder, "the runs of traffic"))
        if isinstance(found, Path):
            steps = simulate_runs(found, *more, preferences.sumo_folders())
        else:
            steps = _simulated_on_text(found.name, found.as_string(), *more, preferences.sumo_folders())
        scene, result = yield steps
        seip = scene.seip
        first = str(result.paths[0])
        seip.traffic.file = bpy.path.relpath(first) if named.startswith("//") else first
        seip.traffic.runs = named
        seip.simulation.facts = result.summary
        show_traffic(scene, result.first, result.warnings[0])
        self.warn(result.messages)
        self.report({"INFO"}, f"{result.summary}; press play")


def _simulated_on_text(name: str, text: str, *more: Any) -> Generator[Progress, None, SimulatedRuns]:  # noqa: ANN401  # of `simulate_runs`
    """Simulate traffic on a map that is a text in the open file."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / Path(name).name
        path.write_text(text, encoding="utf-8")
        return (yield from simulate_runs(path, *more))


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw where traffic comes from."""
    traffic = context.scene.seip.traffic
    column = layout.column(align=True)
    draw_path(column, traffic, "file", "Traffic (.npz, .xml)", named=False)
    files = traffic.files()
    if files is not None and not files.trajectories:
        draw_path(column, traffic, "routes", "Routes (vehicle types)", named=False)
        draw_path(column, traffic, "net", "Network (.net.xml)", named=False)
    draw_reason(layout, why_no_load(context.scene) if traffic.file else "")  # an empty field says so itself
    row = layout.row(align=True)
    draw_run(row, "seip.load_traffic")
    row.operator("seip.clear_traffic", text="", icon="TRASH")
    row.operator("screen.animation_play", text="", icon="PLAY")
    for line in traffic.loaded.splitlines():
        draw_sentence(layout, line)


def draw_simulation(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw how traffic is simulated, and what was simulated last."""
    scene = context.scene
    simulation = scene.seip.simulation
    preferences.draw_missing(layout)
    draw_settings(layout, simulation, "flow", "pedestrians", "duration", "count")
    found = simulation.street_map()
    draw_path(layout, simulation, "map", placeholder="OpenDRIVE (.xodr)" if found is None else Path(found.name).name)
    draw_path(layout, simulation, "folder")
    reason = why_no_simulation(scene)
    draw_reason(layout, "" if preferences.sumo() is None else reason)  # without SUMO the sentence is there already
    draw_run(layout, "seip.simulate_traffic")
    if simulation.facts:
        draw_sentence(layout, f"{simulation.facts}. {USED}")
