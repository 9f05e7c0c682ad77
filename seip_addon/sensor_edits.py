"""Edits of placed sensors in the scene: moved, rotated, deleted or added."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from .core.arrays import Float
from .core.errors import SeipError
from .core.results.placement_record import RecordedSensor, parsed_record
from .core.workflows.moved_sensors import BY_HAND
from .scene import contract
from .scene.sensors import labelled_sensors, pose_of

SAME_PLACE = 1e-5
"""Metres, and cosines, by which single precision may move a sensor."""


@dataclass(frozen=True)
class SensorEdits:
    """How the sensors in a scene differ from those of its placement, by their labels.

    Parameters
    ----------
    moved, gone, added : tuple of str
        Moved or turned, or of another type now; no longer there; not the placement's.
    """

    moved: tuple[str, ...] = ()
    gone: tuple[str, ...] = ()
    added: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        """Whether there are any."""
        return bool(self.moved or self.gone or self.added)

    def describe(self) -> str:
        """Return what was done, in a sentence; empty where nothing was."""
        done = (("moved", self.moved), ("deleted", self.gone), ("added", self.added))
        parts = [f"{', '.join(labels)} {what}" for what, labels in done if labels]
        return f"By hand: {'; '.join(parts)}." if parts else ""


def sensor_edits(scene: bpy.types.Scene) -> SensorEdits:
    """Compare the sensors in a scene, hidden or not, with its placement."""
    text = scene.seip.result.record
    placed = {sensor.id: sensor for sensor in parsed_record(text).sensors} if text else {}
    there = labelled_sensors(scene, hidden=True)
    return SensorEdits(
        tuple(label for label, thing in there.items() if label in placed and not _is_there(thing, placed[label])),
        tuple(label for label in placed if label not in there),
        tuple(label for label in there if label not in placed),
    )


def position_names(scene: bpy.types.Scene) -> dict[str, str]:
    """Return names for where the scene's sensors hang, by their labels, for those at no candidate pose."""
    named = {
        label: str(thing.get(contract.POSITION, "")) for label, thing in labelled_sensors(scene, hidden=True).items()
    }
    return {label: _moved_from(name) for label, name in named.items()}


def same_pose(one: tuple[Float, Float], other: tuple[Float, Float]) -> bool:
    """Return whether two poses, each a place (3,) and a turn (3, 3), are the same but for single precision."""
    reach = SAME_PLACE * max(1.0, float(np.abs(other[0]).max()))
    near = np.allclose(one[0], other[0], rtol=0, atol=reach)
    return near and np.allclose(one[1], other[1], rtol=0, atol=SAME_PLACE)


def _moved_from(name: str) -> str:
    return name if not name or name.startswith(BY_HAND) else f"{BY_HAND}, from {name}"


def _is_there(thing: bpy.types.Object, sensor: RecordedSensor) -> bool:
    try:
        pose = pose_of(thing)
    except SeipError:  # it has no proper transform any more
        return False
    recorded = np.array(sensor.local_m), sensor.orientation
    return same_pose(pose, recorded) and thing.get(contract.SENSOR) == sensor.sensor
