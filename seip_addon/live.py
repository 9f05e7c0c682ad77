"""Live coverage of sensors while they are moved.

A handler notes that something moved; a timer, a moment later, casts the rays of
those sensors alone and colours the road anew. Neither is there while this is off.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import bpy
import numpy as np

from . import preferences, state
from .core.arrays import Boolean, Integer
from .core.errors import SeipError
from .core.placement.deployment import Deployment, Sensor
from .core.scans.sensor import MountedSensor
from .core.visibility.rotated_sensors import Onlooker
from .hand import same_pose
from .scene import contract
from .scene.sensors import read_sensors
from .scene.write import show_seen_by

DELAY = 0.02
"""Seconds from a movement to the look at it: a drag reports many."""


@dataclass
class Live:
    """What is followed.

    Parameters
    ----------
    scene : int
        The scene's session number.
    onlooker : Onlooker
        Of its site.
    sensors : dict of str to (MountedSensor, (t,) bool)
        Where each was when it was looked from last, and what it saw.
    coverage : float
        Share of the targets that some sensor sees.
    moved : tuple of str
        Labels of those that are not where the placement put them.
    seconds : float
        How long the last look took.
    problem : str
        Why nothing is followed at the moment.
    """

    scene: int
    known: state.Held
    onlooker: Onlooker
    sensors: dict[str, tuple[MountedSensor, Boolean]] = field(default_factory=dict)
    coverage: float = 0.0
    moved: tuple[str, ...] = ()
    seconds: float = 0.0
    problem: str = ""


following: Live | None = None


def start(scene: bpy.types.Scene, known: state.Held, onlooker: Onlooker) -> None:
    """Follow the sensors of a scene from now on, from what the placement's own see."""
    global following  # noqa: PLW0603  # one scene is followed at a time
    stop()
    if known.plan is None or known.grid is None:
        raise RuntimeError("there is no placement to follow")
    following = Live(scene.session_uid, known, onlooker, _as_placed(known.plan.deployment, known.grid.visible))
    for event, handler in _handlers():
        getattr(bpy.app.handlers, event).append(handler)
    look()


def stop() -> None:
    """Follow nothing any more."""
    global following  # noqa: PLW0603  # as above
    if following is None:
        return
    following = None
    for event, handler in _handlers():
        getattr(bpy.app.handlers, event).remove(handler)
    if bpy.app.timers.is_registered(look):
        bpy.app.timers.unregister(look)


def look() -> None:
    """Look from the sensors that moved, and colour the road anew."""
    if following is None:
        return
    began = time.perf_counter()
    try:
        _look(following, state.scene_of(following.scene))
        following.problem = ""
    except SeipError as error:
        following.problem = str(error)
    following.seconds = time.perf_counter() - began


def _look(live: Live, scene: bpy.types.Scene) -> None:
    if live.known.watch.changed:
        raise SeipError("the scene has changed: place again, or turn this off")
    if live.known.record != scene.seip.result.record:
        raise SeipError("this is another placement: turn this off and on again")
    sensors = {sensor.label: sensor for sensor in read_sensors(scene, preferences.catalogue())}
    for label in [label for label in live.sensors if label not in sensors]:
        del live.sensors[label]
    for label, sensor in sensors.items():
        if label not in live.sensors or not _same(live.sensors[label][0], sensor):
            live.sensors[label] = (sensor, live.onlooker.see(sensor.model, sensor.xyz, sensor.orientation))
    seen_by: Integer = np.sum([seen for _, seen in live.sensors.values()], axis=0, dtype=np.int64)
    live.coverage = float(np.count_nonzero(seen_by)) / len(seen_by)
    live.moved = _moved(live, sensors)
    show_seen_by(scene, seen_by)


def _moved(live: Live, sensors: dict[str, MountedSensor]) -> tuple[str, ...]:
    plan = live.known.plan
    placed = {} if plan is None else {sensor.label: sensor for sensor in plan.deployment.sensors}
    return tuple(
        label for label, sensor in sensors.items() if label not in placed or not _same(sensor, _mounted(placed[label]))
    )


def _as_placed(deployment: Deployment, visible: Boolean) -> dict[str, tuple[MountedSensor, Boolean]]:
    """Return what is known of sensors at candidate poses; the others are looked from anew."""
    there = [(sensor, sensor.pose) for sensor in deployment.sensors if sensor.pose is not None]
    return {sensor.label: (_mounted(sensor), visible[pose]) for sensor, pose in there}


def _mounted(sensor: Sensor) -> MountedSensor:
    return MountedSensor(sensor.label, sensor.model, sensor.xyz, sensor.orientation)


def _same(one: MountedSensor, other: MountedSensor) -> bool:
    return same_pose((one.xyz, one.orientation), (other.xyz, other.orientation)) and one.model.key == other.model.key


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _on_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Have a look soon where a sensor moved, came or went; never at once, as looking changes the scene."""
    if following is None or scene.session_uid != following.scene or bpy.app.timers.is_registered(look):
        return
    objects = [update for update in depsgraph.updates if isinstance(update.id, bpy.types.Object)]
    moved = any(update.is_updated_transform and contract.SENSOR in update.id for update in objects)
    rebuilt = any(not (update.is_updated_transform or update.is_updated_geometry) for update in objects)
    if moved or rebuilt:
        _look_soon()


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _on_undo(*_: object) -> None:
    """Have a look at what an undo or redo brought back: Blender names no object."""
    if not bpy.app.timers.is_registered(look):
        _look_soon()


def _look_soon() -> None:
    bpy.app.timers.register(look, first_interval=DELAY)


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _on_load(*_: object) -> None:
    stop()


def _handlers() -> tuple[tuple[str, Callable[..., None]], ...]:
    return (
        ("depsgraph_update_post", _on_update),
        ("undo_post", _on_undo),
        ("redo_post", _on_undo),
        ("load_pre", _on_load),
    )


CLASSES: tuple[type, ...] = ()


def detach() -> None:
    """Follow nothing any more."""
    stop()
