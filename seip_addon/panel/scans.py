"""Scans of traffic: the point cloud of a frame."""

from __future__ import annotations

import time
from collections.abc import Generator, Sequence

import bpy
import numpy as np

from ..core.base.counts import counted
from ..core.base.progress import Progress, finish
from ..core.output.pictures.palette import (
    MAX_INTENSITY,
    STATIC_COLOUR,
    By,
    cloud_colours,
    rgb,
    sensor_colour,
    strength_ramp,
)
from ..core.output.results.versions import versions
from ..core.sensing.scans.frame import Frame
from ..core.sensing.scans.run_folder import Run
from ..core.sensing.scans.sensor import MountedSensor
from ..core.sensing.traffic.source import load_traffic
from ..core.workflows.recording import RecordingSettings, frame_number, make_run, simulation_of
from ..scene import contract
from ..scene.read import read_scene
from ..scene.sensors import read_sensors
from ..scene.traffic import read_traffic
from . import overlays, preferences
from .layout import draw_reason, draw_run, draw_sentence, draw_settings
from .legend import Block, Entry
from .overlays import Layer, Overlay
from .scene_status import no_sensors
from .session import LastScan, session
from .work import Job, LongWork

NAME = "point cloud"
RAMP_STEPS = 8
POINT_SIZE = 2.0  # pixels, at the interface's usual scale
NO_TRAFFIC = "There is nothing to scan: name a traffic file, or animate objects in SEIP Traffic."


def forget_scan(scene: bpy.types.Scene) -> None:
    """Let go of a scene's scan."""
    session.of(scene).scan = None
    overlays.hide(scene, NAME)


def recolour_cloud(scene: bpy.types.Scene) -> None:
    """Show the point cloud of a scene, if it is shown, in the colours that its panel asks for."""
    if overlays.find(scene, NAME) is not None:
        _show_cloud(scene)


def _show_cloud(scene: bpy.types.Scene) -> None:
    scan = session.of(scene).scan
    if scan is not None:
        overlays.show(scene, NAME, cloud_overlay(scan.frame, scan.run.sensors, scene.seip.view.cloud_colour))


def cloud_overlay(frame: Frame, sensors: Sequence[MountedSensor], by: By) -> Overlay:
    """Return a frame's points, coloured by sensor, intensity or instance."""
    layer = Layer("POINTS", np.ascontiguousarray(frame.points), cloud_colours(frame, by), POINT_SIZE)
    block = Block(f"{len(frame):,} points at {frame.time:.2f} s", _entries(frame, sensors, by))
    return Overlay((layer,), lambda _scene: block)


def _entries(frame: Frame, sensors: Sequence[MountedSensor], by: By) -> tuple[Entry, ...]:
    if by == "sensor":
        counts = np.bincount(frame.sensor, minlength=len(sensors))
        return tuple(
            Entry(f"{sensor.label}  {sensor.model.key}  {count:,}", (rgb(sensor_colour(number)),))
            for number, (sensor, count) in enumerate(zip(sensors, counts.tolist(), strict=True))
        )
    if by == "intensity":
        ramp = strength_ramp(np.linspace(0.0, 1.0, RAMP_STEPS)).tolist()
        return (Entry(f"intensity 0 to {MAX_INTENSITY:g} and more", tuple(ramp)),)
    users = ((1.0, 0.4, 0.4), (0.4, 1.0, 0.6), (0.4, 0.6, 1.0))
    return (Entry("one colour for each road user", users), Entry("standing still", (rgb(STATIC_COLOUR),)))


def why_no_scan(scene: bpy.types.Scene) -> str:
    """Return why nothing can be scanned; nothing where it can."""
    if reason := no_sensors(scene):
        return reason
    there = scene.seip.traffic.file or contract.find(scene, contract.TRAFFIC) is not None
    return "" if there else NO_TRAFFIC


class SEIP_OT_scan_frame(LongWork, bpy.types.Operator):
    """Show the point cloud of the placed sensors at the current frame"""

    obstacles = (why_no_scan,)
    bl_label = "Scan This Frame"
    bl_options = {"REGISTER"}  # nothing in the file changes

    def job(self, scene: bpy.types.Scene) -> Job:
        """Scan the scene as it is, and show the points."""
        now = scene.frame_current_final * scene.render.fps_base / scene.render.fps  # seconds, 0 at frame 0
        scene, result = yield _scanned(_run_of(scene), now, session.of(scene).scan)
        session.of(scene).scan = result
        _show_cloud(scene)
        self.warn(result.simulation.warnings)
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
    began = time.perf_counter()
    frame = simulation.frame(*frame_number(run, at))
    return LastScan(run, simulation, frame, time.perf_counter() - began)


def _run_of(scene: bpy.types.Scene) -> Generator[Progress, None, Run]:
    """Return a job that gathers all that scans follow from, as the scene is now; it reads the traffic of files."""
    settings = RecordingSettings(scene.seip.traffic.scan())
    geometry, sensors = read_scene(scene).geometry, read_sensors(scene, preferences.catalogue())
    files = scene.seip.traffic.files()
    animated = finish(read_traffic(scene)) if files is None else None

    def steps() -> Generator[Progress, None, Run]:
        trajectories = animated if animated is not None else (yield from load_traffic(files, geometry)).trajectories
        return make_run(geometry, sensors, trajectories, settings, versions(blender=bpy.app.version_string))

    return steps()


def draw_scan(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw how scans are made, and the last."""
    traffic = context.scene.seip.traffic
    if draw_reason(layout, why_no_scan(context.scene)):
        return
    draw_settings(layout, traffic, "noise", "seed", "rolling_shutter")
    draw_run(layout, "seip.scan_frame")
    scan = session.of(context.scene).scan
    for line in scan.facts if scan is not None else ():
        draw_sentence(layout, line)
    if overlays.find(context.scene, NAME) is not None:
        layout.row(align=True).prop(context.scene.seip.view, "cloud_colour", expand=True)
        layout.operator("seip.hide_overlay", icon="X").name = NAME
