"""Last scan of each scene, shown as a point cloud."""

import time
from collections.abc import Sequence

import bpy
import numpy as np

from ..core.output.pictures.colours import By, cloud_colours, sensor_colour, strength_ramp
from ..core.output.pictures.palette import MAX_INTENSITY, STATIC_COLOUR, rgb
from ..core.sensing.scans.frame import Frame
from ..core.sensing.scans.run_folder import Run
from ..core.sensing.scans.sensor import MountedSensor
from ..core.sensing.scans.simulation import Simulation
from ..core.workflows.recording import frame_number
from ..state.overlay import Block, Colour, Entry, Layer, Overlay
from ..state.session import LastScan, session
from . import overlays

NAME = "point cloud"
RAMP_STEPS = 8
POINT_SIZE = 2.0  # pixels, at the interface's usual scale


def now(scene: bpy.types.Scene) -> float:
    """Return the time of a scene's current frame in seconds: 0 at frame 0."""
    return float(scene.frame_current_final * scene.render.fps_base / scene.render.fps)


def measure(run: Run, simulation: Simulation, at: float) -> LastScan:
    """Scan at a time in seconds."""
    began = time.perf_counter()
    frame = simulation.frame(*frame_number(run, at))
    return LastScan(run, simulation, frame, time.perf_counter() - began)


def keep(scene: bpy.types.Scene, scan: LastScan) -> None:
    """Keep a scan and show its points."""
    session.of(scene).scan = scan
    show_cloud(scene)


def show_cloud(scene: bpy.types.Scene) -> None:
    """Show the points of a scene's last scan, in the colours that its panel asks for."""
    scan = session.of(scene).scan
    if scan is not None:
        overlays.show(scene, NAME, cloud_overlay(scan.frame, scan.run.sensors, scene.seip.view.cloud_colour))


def hide_cloud(scene: bpy.types.Scene) -> None:
    """Let go of a scene's scan."""
    session.of(scene).scan = None
    overlays.hide(scene, NAME)


def cloud_overlay(frame: Frame, sensors: Sequence[MountedSensor], by: By) -> Overlay:
    """Return a frame's points, coloured by sensor, intensity or instance."""
    layer = Layer("POINTS", np.ascontiguousarray(frame.points), cloud_colours(frame, by), POINT_SIZE)
    block = Block(f"{len(frame):,} points at {frame.time:.2f} s", _entries(frame, sensors, by))
    return Overlay((layer,), lambda _scene: block)


def _entries(frame: Frame, sensors: Sequence[MountedSensor], by: By) -> tuple[Entry, ...]:
    if by == "sensor":
        counts = np.bincount(frame.sensor, minlength=len(sensors))
        return tuple(
            Entry(f"{sensor.label}  {sensor.model.key}  {count:,}", (_opaque(rgb(sensor_colour(number))),))
            for number, (sensor, count) in enumerate(zip(sensors, counts.tolist(), strict=True))
        )
    if by == "intensity":
        ramp = tuple(_opaque(colour) for colour in strength_ramp(np.linspace(0.0, 1.0, RAMP_STEPS)).tolist())
        return (Entry(f"intensity 0 to {MAX_INTENSITY:g} and more", ramp),)
    users = tuple(_opaque(colour) for colour in ((1.0, 0.4, 0.4), (0.4, 1.0, 0.6), (0.4, 0.6, 1.0)))
    return (Entry("one colour for each road user", users), Entry("standing still", (_opaque(rgb(STATIC_COLOUR)),)))


def _opaque(colour: Sequence[float]) -> Colour:
    red, green, blue = colour
    return red, green, blue, 1.0
