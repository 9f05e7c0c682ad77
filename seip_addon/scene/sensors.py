"""Sensors in the scene: empties in ``SEIP Sensors``.

`tests/scene/test_sensors.py` shows its use.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import bpy
import numpy as np

from ..core.base.arrays import Float
from ..core.base.errors import SeipError
from ..core.sensing.lidar.catalogue import find_models
from ..core.sensing.lidar.model import LidarModel
from ..core.sensing.scans.sensor import MountedSensor
from . import contract


def read_sensors(
    scene: bpy.types.Scene, catalogue: Mapping[str, LidarModel], *, hidden: bool = False
) -> tuple[MountedSensor, ...]:
    """Read where each sensor is and how it is turned: as the viewport shows it, moved by hand or not.

    An empty's x axis points along azimuth zero and its z axis along the sensor's
    axis; its scale means nothing. Hidden empties do not count unless they are
    requested. A sensor without a label gets the first free one.

    Parameters
    ----------
    catalogue : mapping of str to LidarModel
        Sensor types by the keys in the empties' ``seip_sensor``.
    hidden : bool
        Whether hidden empties count.

    Returns
    -------
    tuple of MountedSensor
        By label, S2 before S10.

    Raises
    ------
    SeipError
        There is no sensor, or one names no type, an unknown one, or has no proper transform.
    """
    scene.view_layers[0].update()
    sensors = labelled_sensors(scene, hidden=hidden)
    if not sensors:
        count = len(_empties(scene))
        others = f"; {count} hidden ones do not count" * bool(count)
        raise SeipError(
            f"scene {scene.name!r} has no sensors in the collection {contract.SENSORS!r}{others}: place some first"
        )
    return tuple(_mounted(obj, label, catalogue) for label, obj in sensors.items())


def changed_beams(scene: bpy.types.Scene, sensors: Sequence[MountedSensor]) -> tuple[str, ...]:
    """Return a warning for each sensor that was placed with other beams than its type has now."""
    empties = labelled_sensors(scene, hidden=True)
    return tuple(
        f"{sensor.label} was placed with other beams than {sensor.model.key} has now: name the catalogue or the unit's "
        "file that it was placed with (--catalogue), or place again"
        for sensor in sensors
        if empties[sensor.label].get(contract.BEAMS, sensor.model.beams_key) != sensor.model.beams_key
    )


def labelled_sensors(scene: bpy.types.Scene, *, hidden: bool = False) -> dict[str, bpy.types.Object]:
    """Return the empties of sensors by their labels, S2 before S10; see `read_sensors`."""
    empties = [obj for obj in _empties(scene) if hidden or _is_shown(obj, scene.view_layers[0])]
    labels = _labels(empties)
    return {labels[obj.name]: obj for obj in sorted(empties, key=lambda obj: _natural(labels[obj.name]))}


def sensor_positions(scene: bpy.types.Scene) -> tuple[str, ...]:
    """Return the names of the positions at which the sensors of a scene were placed.

    Raises
    ------
    SeipError
        There is no sensor, or one that was not placed at a candidate position.
    """
    empties = labelled_sensors(scene)
    if not empties:
        raise SeipError("the scene has no sensors to keep: place some first")
    found = {label: str(empty.get(contract.POSITION, "")) for label, empty in empties.items()}
    others = [label for label, position in found.items() if not position]
    if others:
        raise SeipError(
            f"sensor {', '.join(others)} was not placed at a candidate position: name positions with --require instead"
        )
    return tuple(found.values())


def _is_shown(obj: bpy.types.Object, layer: bpy.types.ViewLayer) -> bool:
    return obj.name in layer.objects and bool(obj.visible_get(view_layer=layer))


def _empties(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    collection = contract.find(scene, contract.SENSORS)
    return [] if collection is None else [obj for obj in collection.all_objects if obj.type == "EMPTY"]


def placed_sensors(scene: bpy.types.Scene) -> dict[str, bpy.types.Object]:
    """Return the empties of sensors by their labels, S2 before S10; those without a label are not among them."""
    collection = contract.find(scene, contract.SENSORS)
    objects = [] if collection is None else [obj for obj in collection.all_objects if contract.LABEL in obj]
    return {str(obj[contract.LABEL]): obj for obj in sorted(objects, key=lambda one: _natural(one[contract.LABEL]))}


def _mounted(obj: bpy.types.Object, label: str, catalogue: Mapping[str, LidarModel]) -> MountedSensor:
    key = obj.get(contract.SENSOR)
    if not isinstance(key, str):
        raise SeipError(
            f"empty {obj.name!r} in {contract.SENSORS!r} names no LiDAR: "
            f"set its custom property {contract.SENSOR} to a key of the catalogue, or take it out"
        )
    try:
        model = find_models(catalogue, [key])[key]
    except SeipError as error:
        raise SeipError(f"empty {obj.name!r}: {error}") from error
    return MountedSensor(label, model, *pose_of(obj))


def pose_of(obj: bpy.types.Object) -> tuple[Float, Float]:
    """Return where a sensor's empty is, (3,) metres, and how it is turned, (3, 3) from its axes to the site's.

    Raises
    ------
    SeipError
        It has no proper transform.
    """
    matrix = np.array(obj.matrix_world, dtype=np.float64)
    length = np.linalg.norm(matrix[:3, :3], axis=0)
    if not (np.isfinite(matrix).all() and (length > 0).all()):
        raise SeipError(f"empty {obj.name!r} has an invalid transform or zero scale: reset it")
    return matrix[:3, 3], _orthonormal(matrix[:3, :3] / length)


def _orthonormal(matrix: Float) -> Float:
    """Return the orthogonal matrix next to one that single precision has left a little off (polar decomposition)."""
    left, size, right = np.linalg.svd(matrix)
    nearest: Float = left @ right
    return nearest if np.allclose(size, 1.0, atol=1e-3) else matrix


def _labels(empties: list[bpy.types.Object]) -> dict[str, str]:
    """Return each empty's label by its name: its own, or a new one where it has none or a copy has the same."""
    found: dict[str, str] = {}
    for obj in sorted(empties, key=lambda obj: _natural(obj.name)):
        label = obj.get(contract.LABEL)
        if isinstance(label, str) and label and label not in found.values():
            found[obj.name] = label
    for obj in empties:
        if obj.name not in found:
            free = (f"S{number}" for number in range(1, len(empties) + 1))
            taken = {*found.values(), *(other.get(contract.LABEL) for other in empties)}
            found[obj.name] = next(label for label in free if label not in taken)
    return found


def _natural(text: str) -> list[tuple[int, str]]:
    """Return a key by which numbers in texts sort by their value."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", text)]
