"""Corrections of a scene by the recording of its sensors."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix

from ..core.sensing.recordings.comparison import Change
from ..core.sensing.recordings.verification import Verification
from ..core.sensing.scans.sensor import MountedSensor
from ..core.site.scene_geometry import FROM_SURVEY
from ..core.workflows.verifying import box_triangles
from . import contract
from .read import Shown, shown_parts
from .sensors import labelled_sensors


def correct_scene(scene: bpy.types.Scene, found: Verification) -> tuple[str, ...]:
    """Add what a verification found, remove what is gone, and move the sensors to their fitted poses.

    New objects become boxes in ``SEIP Occluders``. Children of a removed object stay where they are; its pieces go with
    it. A second correction by the same verification changes nothing.

    Returns
    -------
    tuple of str
        A sentence for each object that cannot be corrected: only a part of it is gone, or it is in a linked collection.
    """
    left = {mesh.name for mesh in found.corrected.occluders}
    gone = {change.name for change in found.changes if change.kind == "gone"}
    problems = _remove_gone(scene, gone, left) if gone else []
    for change in found.changes:
        if change.kind == "new":
            _add_box(scene, change)
    sensors = labelled_sensors(scene)
    for one in found.comparisons:
        problems += _move(sensors.get(one.sensor.label), one.sensor)
    return tuple(problems)


def _remove_gone(scene: bpy.types.Scene, gone: set[str], left: set[str]) -> list[str]:
    """Remove objects of which nothing is left, and return a sentence for each that cannot be removed."""
    parts = [part for part in shown_parts(scene, contract.members(scene)) if part.triangles is not None]
    sources = {part.source.session_uid: part.source for part in parts if part.name in gone and _stands(part)}
    problems = []
    for source in sources.values():
        own = [part for part in parts if part.source == source]
        if not all(_stands(part) and part.name in gone - left for part in own):
            problems.append(f"a part of {source.name!r} is no longer there: delete that part and verify again")
            continue
        fixed = [one for one in _collections_of(scene, source) if one.library or one.override_library]
        if fixed:
            library = source.library or next((one.library for one in fixed if one.library), None)
            origin = library.filepath if library else "another file"
            problems.append(
                f"{source.name!r} is no longer there, but is linked from {origin}: remove it there, or make it local "
                "and verify again"
            )
            continue
        _remove(scene, source)
    return problems


def _stands(part: Shown) -> bool:
    """Return whether a part of a scene is an occluder or a pole, and no surface of the street."""
    return bool(part.collections & {contract.OCCLUDERS, contract.POLES}) and not (
        part.collections & {contract.ROADS, contract.GROUND}
    )


def _collections_of(scene: bpy.types.Scene, obj: bpy.types.Object) -> list[bpy.types.Collection]:
    """Return the collections of a scene that contain an object."""
    return [one for one in (scene.collection, *scene.collection.children_recursive) if obj in set(one.objects)]


def _remove(scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    """Take an object and its pieces out of a scene; its other children stay where they are."""
    pieces = [child for child in obj.children if child.get(contract.PIECE_OF) == obj.name]
    for piece in pieces:
        _remove(scene, piece)
    collections = _collections_of(scene, obj)
    elsewhere = set(obj.users_collection) - set(collections)
    if obj.library or elsewhere:  # other scenes keep it
        for collection in collections:
            collection.objects.unlink(obj)
        return
    for child in [child for child in obj.children if child not in pieces]:
        at = child.matrix_world.copy()
        child.parent = None
        child.matrix_world = at
    bpy.data.objects.remove(obj)


def _add_box(scene: bpy.types.Scene, change: Change) -> None:
    """Add a new object as a box, in place of the one that an earlier correction added for it."""
    occluders = contract.find_or_make(scene, contract.OCCLUDERS)
    for obj in list(occluders.objects):
        if contract.NUMBER.sub("", obj.name) == change.name and obj.get(contract.SOURCE) == FROM_SURVEY:
            bpy.data.objects.remove(obj)
    middle = change.box[:3]
    mesh = bpy.data.meshes.new(change.name)
    corners = box_triangles(change.box).reshape(-1, 3) - middle
    mesh.from_pydata(corners.tolist(), [], np.arange(len(corners)).reshape(-1, 3).tolist())
    box = bpy.data.objects.new(change.name, mesh)
    box.location = middle
    box[contract.SOURCE] = FROM_SURVEY
    occluders.objects.link(box)


def _move(empty: bpy.types.Object | None, sensor: MountedSensor) -> list[str]:
    """Move a sensor's empty to a pose, and return a sentence if it cannot be moved."""
    if empty is None:
        return [f"sensor {sensor.label} is no longer in the scene: verify again"]
    if empty.library:
        return [f"sensor {sensor.label} is linked from {empty.library.filepath}: move it there, or make it local"]
    rotation = Matrix(sensor.orientation.tolist()).to_quaternion()
    empty.matrix_world = Matrix.LocRotScale(sensor.xyz.tolist(), rotation, empty.matrix_world.to_scale())
    return []
