"""Simulation of traffic with SUMO on the map of the site."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import bpy
from bpy.props import IntProperty, StringProperty

from ..core.base.errors import SeipError
from ..core.base.progress import Progress
from ..core.programs.sumo_programs import NETWORK_SUFFIX
from ..core.workflows.traffic_simulation import DEFAULT_RUNS, SimulatedRuns, SimulationSettings, simulate_runs
from ..core.world.openstreetmap.site import is_extract
from ..core.world.traffic_simulation.demand import Demand
from ..scene import contract
from ..scene.read import read_scene
from . import preferences, scene_status
from .layout import Status, draw_path, draw_reason, draw_run, draw_sentence, draw_settings
from .properties import absolute, as_typed, of_setting, path_property, saved_path
from .traffic import EXAMPLE, EXAMPLE_MAP, show_traffic
from .work import Job, LongWork

_MOST_SECONDS = 3600.0
NO_MAP = "There is no map to simulate traffic on: name the OpenDRIVE map (.xodr) that this site was built from."
_TEXT_MAP = "streets.net.xml"
"""Name for the map of a text whose own name is no name of a file."""
USED = "Detection and placements in traffic use these runs."
OTHER_SETTINGS = "The settings have changed since: simulate again."


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
    made_with: StringProperty(name="Made With", description="Settings of the last simulation")

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

    def key(self) -> str:
        """Return all that the runs follow from, as one text."""
        return "|".join(
            (self.map, *(f"{value:g}" for value in (self.flow, self.pedestrians, self.duration, self.count)))
        )


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
        named, key = request.folder, request.key()
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
        seip.simulation.facts, seip.simulation.made_with = result.summary, key
        show_traffic(scene, result.first, result.warnings[0])
        for sentence in result.messages:
            self.report({"WARNING"}, sentence)
        self.report({"INFO"}, f"{result.summary}; press play")


def _simulated_on_text(name: str, text: str, *more: Any) -> Generator[Progress, None, SimulatedRuns]:  # noqa: ANN401  # of `simulate_runs`
    """Simulate traffic on a map that is a text in the open file."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / (Path(name).name or _TEXT_MAP)
        path.write_text(text, encoding="utf-8")
        return (yield from simulate_runs(path, *more))


def status(scene: bpy.types.Scene) -> Status:
    """Return whether the settings have changed since the last simulation."""
    simulation = scene.seip.simulation
    return Status(bool(simulation.facts) and simulation.made_with != simulation.key())


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
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
    if not simulation.facts:
        return
    draw_sentence(layout, f"{simulation.facts}. {USED}")
    if status(scene).changed:
        draw_sentence(layout, OTHER_SETTINGS, icon="ERROR")
