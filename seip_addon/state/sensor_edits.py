"""Manual edits of placed sensors in the scene: moved, rotated, of another type, deleted or added."""

from dataclasses import dataclass

import bpy
import numpy as np

from ..core.base.arrays import Float
from ..core.base.errors import SeipError
from ..core.output.results.placement_record import RecordedSensor, parsed_record
from ..core.workflows.moved_sensors import BY_HAND
from ..scene import contract
from ..scene.sensors import labelled_sensors, pose_of

POSE_TOLERANCE = 1e-5  # of single precision: of rotations absolute, of positions relative beyond a metre


@dataclass(frozen=True)
class SensorEdits:
    """Differences between the sensors in a scene and those of its placement, as labels.

    Parameters
    ----------
    moved : tuple of str
        Moved, rotated or of another type.
    deleted, added : tuple of str
    """

    moved: tuple[str, ...] = ()
    deleted: tuple[str, ...] = ()
    added: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.moved or self.deleted or self.added)

    def describe(self) -> str:
        """Return the edits as a sentence, empty without any."""
        edits = (("moved", self.moved), ("deleted", self.deleted), ("added", self.added))
        parts = [f"{', '.join(labels)} {edit}" for edit, labels in edits if labels]
        return f"By hand: {'; '.join(parts)}." if parts else ""


def sensor_edits(scene: bpy.types.Scene) -> SensorEdits:
    """Compare the sensors in a scene, hidden or not, with its placement."""
    text = scene.seip.result.record
    placed = {sensor.id: sensor for sensor in parsed_record(text).sensors} if text else {}
    present = labelled_sensors(scene, hidden=True)
    return SensorEdits(
        moved=tuple(label for label in present if label in placed and not _is_same(present[label], placed[label])),
        deleted=tuple(label for label in placed if label not in present),
        added=tuple(label for label in present if label not in placed),
    )


def position_names(scene: bpy.types.Scene) -> dict[str, str]:
    """Return position names by sensor label, for sensors that are not at a candidate pose."""
    sensors = labelled_sensors(scene, hidden=True)
    return {label: _moved_from(str(sensor.get(contract.POSITION, ""))) for label, sensor in sensors.items()}


def same_pose(one: tuple[Float, Float], other: tuple[Float, Float]) -> bool:
    """Return whether two poses, each a position (3,) and a rotation (3, 3), are equal within single precision."""
    tolerance = POSE_TOLERANCE * max(1.0, float(np.abs(other[0]).max()))
    same_position = np.allclose(one[0], other[0], rtol=0, atol=tolerance)
    return same_position and np.allclose(one[1], other[1], rtol=0, atol=POSE_TOLERANCE)


def _moved_from(name: str) -> str:
    return name if not name or name.startswith(BY_HAND) else f"{BY_HAND}, from {name}"


def _is_same(sensor: bpy.types.Object, recorded: RecordedSensor) -> bool:
    try:
        pose = pose_of(sensor)
    except SeipError:  # its transform is degenerate
        return False
    recorded_pose = np.array(recorded.local_m), recorded.orientation
    return same_pose(pose, recorded_pose) and sensor.get(contract.SENSOR) == recorded.sensor
