"""Operators on traffic and its simulation, scans and datasets."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import bpy

from .. import last_scan, preferences, scene_status
from ..core.counts import counted
from ..core.errors import SeipError
from ..core.output.results.versions import versions
from ..core.progress import Progress, finish
from ..core.sensing.scans.run_folder import Record, Run, check_run_folder
from ..core.sensing.scans.sensor import MountedSensor
from ..core.sensing.traffic.source import TrafficFiles, describe_categories, load_traffic
from ..core.sensing.traffic.trajectories import Trajectories
from ..core.site.scene_geometry import SceneGeometry
from ..core.sumo_installation import install_sumo
from ..core.workflows.recording import RecordingSettings, make_run, record, simulation_of
from ..core.workflows.traffic_simulation import SimulatedRuns, simulate_runs
from ..properties.conversion import saved_path
from ..scene import contract
from ..scene.read import read_scene
from ..scene.sensors import labelled_sensors, read_sensors
from ..scene.traffic import animate, clear_traffic, read_traffic
from ..session import LastScan, SceneTraffic, session
from .base import Conditional, Job, LongWork, Outcome

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

    bl_idname = "seip.load_traffic"
    bl_label = "Load Traffic"

    obstacles = (why_no_load,)

    def job(self, scene: bpy.types.Scene) -> Job:
        """Read the traffic onto the scene, and animate its road users."""
        files = scene.seip.traffic.files()
        changed = last_scan.changes(files)
        scene, result = yield load_traffic(files, read_scene(scene).geometry)
        show_traffic(scene, SceneTraffic(files, changed, result.trajectories), result.warnings)
        for sentence in result.warnings:
            self.report({"WARNING"}, sentence)
        self.report({"INFO"}, f"{counted(len(result.trajectories), 'road user')}; press play")


def show_traffic(scene: bpy.types.Scene, traffic: SceneTraffic, warnings: Sequence[str]) -> None:
    """Animate road users read from files, in place of earlier ones and of their scan, and note what there is."""
    animate(scene, traffic.trajectories)
    last_scan.hide_cloud(scene)
    session.of(scene).traffic = traffic
    scene.seip.traffic.loaded = "\n".join((*_facts(traffic.trajectories), *warnings))


class SEIP_OT_clear_traffic(Conditional, bpy.types.Operator):
    """Remove the loaded road users from the scene; your own objects stay"""

    bl_idname = "seip.clear_traffic"
    bl_label = "Clear Traffic"
    bl_options = {"REGISTER", "UNDO"}

    obstacles = (lambda scene: "" if contract.find(scene, contract.TRAFFIC) else "there is no traffic in the scene",)

    def execute(self, context: bpy.types.Context) -> Outcome:
        """Take it out."""
        scene = context.scene
        clear_traffic(scene)
        session.of(scene).traffic = None
        last_scan.hide_cloud(scene)
        scene.seip.traffic.loaded = ""
        return {"FINISHED"}


class SEIP_OT_scan_frame(LongWork, bpy.types.Operator):
    """Show the point cloud of the placed sensors at the current frame"""

    bl_idname = "seip.scan_frame"
    obstacles = (why_no_scan,)
    bl_label = "Scan This Frame"
    bl_options = {"REGISTER"}  # nothing in the file changes

    def job(self, scene: bpy.types.Scene) -> Job:
        """Scan the scene as it is, and show the points."""
        read = _SceneRead(scene)
        scene, result = yield _scanned(read, last_scan.now(scene), session.of(scene).scan)
        read.keep_traffic(scene)
        last_scan.keep(scene, result)
        for sentence in result.simulation.warnings:
            self.report({"WARNING"}, sentence)
        self.report({"INFO"}, f"{counted(len(result.frame), 'point')} in {1e3 * result.seconds:.0f} ms")


def _scanned(read: _SceneRead, at: float, before: LastScan | None) -> Generator[Progress, None, LastScan]:
    run = yield from read.run()
    if before is not None and before.run.key == run.key:
        run, simulation = before.run, before.simulation
    else:
        simulation = yield from simulation_of(run)
    yield Progress(0, 0, "scan")
    return last_scan.measure(run, simulation, at)


class SEIP_OT_write_dataset(LongWork, bpy.types.Operator):
    """Scan all frames and write them with the boxes of all road users, as datasets for training detectors"""

    bl_idname = "seip.write_dataset"
    obstacles = (why_no_scan,)
    bl_label = "Write Dataset"
    bl_options = {"REGISTER"}  # as above
    stopped_message = "stopped; what is written stays, and the same run goes on from there"

    def job(self, scene: bpy.types.Scene) -> Job:
        """Record the scene as it is, and say what was written."""
        read = _SceneRead(scene)
        folder = saved_path(scene.seip.traffic.folder, "the scans")
        scene, (written, warnings) = yield _recorded(read, folder)
        read.keep_traffic(scene)
        for sentence in warnings:
            self.report({"WARNING"}, sentence)
        self.report({"INFO"}, f"{counted(len(written['frames']), 'frame')} in {folder}")


def _recorded(read: _SceneRead, folder: Path) -> Generator[Progress, None, tuple[Record, tuple[str, ...]]]:
    run = yield from read.run()
    check_run_folder(folder, run)
    simulation = yield from simulation_of(run)
    return (yield from record(folder, run, simulation, read.settings)), tuple(simulation.warnings)


class _SceneRead:
    """All that scans follow from, as the scene is now."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self.settings: RecordingSettings = scene.seip.traffic.recording()
        self._geometry: SceneGeometry = read_scene(scene).geometry
        self._sensors: tuple[MountedSensor, ...] = read_sensors(scene, preferences.catalogue())
        self._files: TrafficFiles | None = scene.seip.traffic.files()
        self._changed: tuple[float, ...] = ()
        self._trajectories: Trajectories | None = None
        if self._files is None:
            self._trajectories = finish(read_traffic(scene))
        else:
            self._changed = last_scan.changes(self._files)
            self._trajectories = last_scan.known_traffic(scene, self._files, self._geometry.origin)

    def run(self) -> Generator[Progress, None, Run]:
        """Read the traffic, where that is still to be done, and gather everything."""
        if self._trajectories is None and self._files is not None:
            self._trajectories = (yield from load_traffic(self._files, self._geometry)).trajectories
        assert self._trajectories is not None  # noqa: S101  # one of the two has given it
        made = versions(blender=bpy.app.version_string)
        return make_run(self._geometry, self._sensors, self._trajectories, self.settings, made)

    def keep_traffic(self, scene: bpy.types.Scene) -> None:
        """Hold what was read from files, so that the next scan need not."""
        if self._files is not None and self._trajectories is not None:
            session.of(scene).traffic = SceneTraffic(self._files, self._changed, self._trajectories)


def _facts(trajectories: Trajectories) -> list[str]:
    begin, end = trajectories.span
    return [f"{counted(len(trajectories), 'road user')}, {begin:g} to {end:g} s", describe_categories(trajectories)]


class SEIP_OT_install_sumo(LongWork, bpy.types.Operator):
    """Download Eclipse SUMO from PyPI into the extension's own folder, where it takes up to 470 MB. It lays out the streets of an extract of OpenStreetMap and simulates traffic"""  # noqa: E501  # a tooltip is one line

    bl_idname = "seip.install_sumo"
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

    bl_idname = "seip.simulate_traffic"
    bl_label = "Simulate Traffic"
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
        seip.detection.runs = seip.goal.runs = named
        seip.simulation.facts, seip.simulation.made_with = result.summary, key
        files = TrafficFiles(result.paths[0])
        show_traffic(scene, SceneTraffic(files, last_scan.changes(files), result.first), result.warnings[0])
        for sentence in result.messages:
            self.report({"WARNING"}, sentence)
        self.report({"INFO"}, f"{result.summary}; press play")


def _simulated_on_text(name: str, text: str, *more: Any) -> Generator[Progress, None, SimulatedRuns]:  # noqa: ANN401  # of `simulate_runs`
    """Simulate traffic on a map that is a text in the open file."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / (Path(name).name or _TEXT_MAP)
        path.write_text(text, encoding="utf-8")
        return (yield from simulate_runs(path, *more))
