"""Operators on traffic and its simulation, scans and datasets."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import bpy

from .. import preferences
from ..core.base.counts import counted
from ..core.base.errors import SeipError
from ..core.base.progress import Progress, finish
from ..core.output.results.versions import versions
from ..core.programs.sumo_installation import install_sumo
from ..core.sensing.scans.run_folder import Record, Run, check_run_folder
from ..core.sensing.traffic.source import describe_categories, load_traffic
from ..core.sensing.traffic.trajectories import Trajectories
from ..core.workflows.recording import RecordingSettings, make_run, record, simulation_of
from ..core.workflows.traffic_simulation import SimulatedRuns, simulate_runs
from ..properties.conversion import saved_path
from ..scene import contract
from ..scene.read import read_scene
from ..scene.sensors import labelled_sensors, read_sensors
from ..scene.traffic import animate, clear_traffic, read_traffic
from ..state import scene_status
from ..state.session import LastScan, session
from ..viewport import last_scan
from .base import Job, LongWork, Outcome, ShortWork

NO_FILE = "There is no traffic file: name one, or animate objects of your own in SEIP Traffic."
NO_TRAFFIC = "There is nothing to scan: name a traffic file, or animate objects in SEIP Traffic."
NO_SENSORS = "There is no sensor in the scene: place sensors first."
NO_MAP = "There is no map to simulate traffic on: name the OpenDRIVE map (.xodr) that this site was built from."
_TEXT_MAP = "streets.net.xml"
"""Name for the map of a text whose own name is no name of a file."""


def why_no_load(scene: bpy.types.Scene) -> str:
    """Return why no traffic can be loaded; nothing where it can."""
    return scene_status.not_own(scene) or ("" if scene.seip.traffic.file else NO_FILE)


def no_sensors(scene: bpy.types.Scene) -> str:
    """Return that the scene has no sensors, or ""."""
    return "" if labelled_sensors(scene) else NO_SENSORS


def why_no_scan(scene: bpy.types.Scene) -> str:
    """Return why nothing can be scanned; nothing where it can."""
    if reason := no_sensors(scene):
        return reason
    there = scene.seip.traffic.file or contract.find(scene, contract.TRAFFIC) is not None
    return "" if there else NO_TRAFFIC


class SEIP_OT_load_traffic(LongWork, bpy.types.Operator):
    """Read the traffic file and animate its road users on the road"""

    obstacles = (why_no_load,)

    def job(self, scene: bpy.types.Scene) -> Job:
        """Read the traffic onto the scene, and animate its road users."""
        scene, result = yield load_traffic(scene.seip.traffic.files(), read_scene(scene).geometry)
        show_traffic(scene, result.trajectories, result.warnings)
        for sentence in result.warnings:
            self.report({"WARNING"}, sentence)
        self.report({"INFO"}, f"{counted(len(result.trajectories), 'road user')}; press play")


def show_traffic(scene: bpy.types.Scene, trajectories: Trajectories, warnings: Sequence[str]) -> None:
    """Animate road users read from files, in place of earlier ones and of their scan, and note what there is."""
    animate(scene, trajectories)
    last_scan.hide_cloud(scene)
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
        last_scan.hide_cloud(scene)
        scene.seip.traffic.loaded = ""


class SEIP_OT_scan_frame(LongWork, bpy.types.Operator):
    """Show the point cloud of the placed sensors at the current frame"""

    obstacles = (why_no_scan,)
    bl_label = "Scan This Frame"
    bl_options = {"REGISTER"}  # nothing in the file changes

    def job(self, scene: bpy.types.Scene) -> Job:
        """Scan the scene as it is, and show the points."""
        scene, result = yield _scanned(_run_of(scene), last_scan.now(scene), session.of(scene).scan)
        last_scan.keep(scene, result)
        for sentence in result.simulation.warnings:
            self.report({"WARNING"}, sentence)
        self.report({"INFO"}, f"{counted(len(result.frame), 'point')} in {1e3 * result.seconds:.0f} ms")


def _scanned(
    reading: Generator[Progress, None, Run], at: float, before: LastScan | None
) -> Generator[Progress, None, LastScan]:
    run = yield from reading
    if before is not None and before.run.key == run.key:
        run, simulation = before.run, before.simulation
    else:
        simulation = yield from simulation_of(run)
    yield Progress(0, 0, "scan")
    return last_scan.measure(run, simulation, at)


class SEIP_OT_write_dataset(LongWork, bpy.types.Operator):
    """Scan all frames and write them with the boxes of all road users, as datasets for training detectors"""

    obstacles = (why_no_scan,)
    bl_options = {"REGISTER"}  # as above
    stopped_message = "stopped; what is written stays, and the same run goes on from there"

    def job(self, scene: bpy.types.Scene) -> Job:
        """Record the scene as it is, and say what was written."""
        folder = saved_path(scene.seip.traffic.folder, "the scans")
        scene, (written, warnings) = yield _recorded(_run_of(scene), scene.seip.traffic.recording(), folder)
        for sentence in warnings:
            self.report({"WARNING"}, sentence)
        self.report({"INFO"}, f"{counted(len(written['frames']), 'frame')} in {folder}")


def _recorded(
    reading: Generator[Progress, None, Run], settings: RecordingSettings, folder: Path
) -> Generator[Progress, None, tuple[Record, tuple[str, ...]]]:
    run = yield from reading
    check_run_folder(folder, run)
    simulation = yield from simulation_of(run)
    return (yield from record(folder, run, simulation, settings)), tuple(simulation.warnings)


def _run_of(scene: bpy.types.Scene) -> Generator[Progress, None, Run]:
    """Return a job that gathers all that scans follow from, as the scene is now; it reads the traffic of files."""
    settings: RecordingSettings = scene.seip.traffic.recording()
    geometry, sensors = read_scene(scene).geometry, read_sensors(scene, preferences.catalogue())
    files = scene.seip.traffic.files()
    animated = finish(read_traffic(scene)) if files is None else None

    def steps() -> Generator[Progress, None, Run]:
        trajectories = animated if animated is not None else (yield from load_traffic(files, geometry)).trajectories
        return make_run(geometry, sensors, trajectories, settings, versions(blender=bpy.app.version_string))

    return steps()


class SEIP_OT_install_sumo(LongWork, bpy.types.Operator):
    """Download Eclipse SUMO from PyPI into the extension's own folder, where it takes up to 470 MB. It lays out the streets of an extract of OpenStreetMap and simulates traffic"""  # noqa: E501  # a tooltip is one line

    bl_label = "Install SUMO"
    bl_options = {"REGISTER"}  # nothing in the file changes
    stopped_message = "stopped; SUMO was not installed"

    obstacles = (lambda _: preferences.why_no_installation(),)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event | None) -> Outcome:
        """Start in the main window: work ends with its window, and that of the preferences is soon closed."""
        main = next((window for window in context.window_manager.windows if window.parent is None), context.window)
        with context.temp_override(window=main):
            return super().invoke(context, event)

    def job(self, _scene: bpy.types.Scene) -> Job:
        """Install it, and report what is there now."""
        yield install_sumo(preferences.pip(), preferences.own_sumo_folder())
        self.report({"INFO"}, preferences.sumo_status()[0])


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
