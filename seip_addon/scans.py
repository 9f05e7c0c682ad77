"""In-memory state of scans: traffic, scanners and the last frame.

By the scene's session number, as `state`; none of it is needed to go on.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import bpy
import numpy as np

from . import state
from .core.arrays import Float
from .core.scans import Frame, Simulation
from .core.scans.run_folder import Run
from .core.traffic import Trajectories
from .core.traffic.source import TrafficFiles
from .core.workflows.recording import frame_number
from .viewport import layers
from .viewport.point_cloud import NAME, cloud_overlay


@dataclass(frozen=True, eq=False)
class HeldTraffic:
    """Traffic that was read from files.

    Parameters
    ----------
    changed : tuple of float
        When each of the files was written, as its system says.
    trajectories : Trajectories
        In the scene's axes.
    """

    files: TrafficFiles
    changed: tuple[float, ...]
    trajectories: Trajectories


@dataclass
class HeldScan:
    """Sensors that are ready to scan, and what they measured last.

    Parameters
    ----------
    run : Run
        What the scans follow from.
    simulation : Simulation
        Of the run.
    seconds : float
        That the scan took.
    in_words : tuple of str
        What came of it, one fact each.
    """

    run: Run
    simulation: Simulation
    frame: Frame
    seconds: float
    in_words: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        counts = np.bincount(self.frame.sensor, minlength=len(self.run.sensors)).tolist()
        users = self.frame.labels.points.sum(axis=1)
        lines = [f"{sensor.label}: {count:,} points" for sensor, count in zip(self.run.sensors, counts, strict=True)]
        lines.append(f"{np.count_nonzero(users)} of {len(users)} road users seen")
        lines.append(f"{self.frame.time:.2f} s, scanned in {1e3 * self.seconds:.0f} ms")
        self.in_words = tuple(lines)


traffic: dict[int, HeldTraffic] = {}
held: dict[int, HeldScan] = {}


def find(scene: bpy.types.Scene) -> HeldScan | None:
    """Return the last scan of a scene, None where there is none."""
    return held.get(scene.session_uid)


def known_traffic(scene: bpy.types.Scene, files: TrafficFiles, origin: Float) -> Trajectories | None:
    """Return the traffic of files that were read before and are still the same, None otherwise."""
    own = traffic.get(scene.session_uid)
    if own is None or (own.files, own.changed) != (files, changes(files)):
        return None
    return own.trajectories if np.array_equal(own.trajectories.origin, origin) else None


def changes(files: TrafficFiles) -> tuple[float, ...]:
    """Return when each of the files was last written; 0 for one that is not there."""
    paths = (files.path, *files.routes, *([files.net] if files.net else []))
    return tuple(path.stat().st_mtime if path.is_file() else 0.0 for path in paths)


def now(scene: bpy.types.Scene) -> float:
    """Return the time of a scene's current frame in seconds: 0 at frame 0."""
    return float(scene.frame_current_final * scene.render.fps_base / scene.render.fps)


def measure(run: Run, simulation: Simulation, at: float) -> HeldScan:
    """Scan at a time in seconds."""
    began = time.perf_counter()
    frame = simulation.frame(*frame_number(run, at))
    return HeldScan(run, simulation, frame, time.perf_counter() - began)


def keep(scene: bpy.types.Scene, scan: HeldScan) -> None:
    """Hold a scan and show its points."""
    held[scene.session_uid] = scan
    keep_following()  # a file may have been saved while it followed
    show_cloud(scene)


def show_cloud(scene: bpy.types.Scene) -> None:
    """Show the points of a scene's last scan, in the colours that its panel asks for."""
    scan = find(scene)
    if scan is not None:
        layers.show(scene, NAME, cloud_overlay(scan.frame, scan.run.sensors, scene.seip.view.cloud_colour))


def hide_cloud(scene: bpy.types.Scene) -> None:
    """Let go of a scene's scan."""
    held.pop(scene.session_uid, None)
    layers.hide(scene, NAME)


def keep_following() -> None:
    """Have a handler of frame changes while a scene follows its timeline."""
    handlers = bpy.app.handlers.frame_change_post
    wanted = any(scene.seip.traffic.follow for scene in bpy.data.scenes)
    if wanted and _frame_changed not in handlers:
        handlers.append(_frame_changed)
    if not wanted:
        _unfollow()


def _unfollow() -> None:
    if _frame_changed in bpy.app.handlers.frame_change_post:
        bpy.app.handlers.frame_change_post.remove(_frame_changed)


def _frame_changed(scene: bpy.types.Scene, *_: object) -> None:
    scan = find(scene)
    busy = state.running is not None or bpy.app.is_job_running("RENDER")
    if scan is not None and scene.seip.traffic.follow and not busy:
        keep(scene, measure(scan.run, scan.simulation, now(scene)))


def forget() -> None:
    """Let go of everything: another file is about to be opened."""
    traffic.clear()
    held.clear()
    _unfollow()


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _before_load(*_: object) -> None:
    forget()


CLASSES: tuple[type, ...] = ()


def attach() -> None:
    """Let go of everything whenever another file is opened."""
    bpy.app.handlers.load_pre.append(_before_load)


def detach() -> None:
    """Let go of everything."""
    bpy.app.handlers.load_pre.remove(_before_load)
    forget()
