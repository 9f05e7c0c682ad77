"""Corrections of a scene by the recording of its sensors."""

from __future__ import annotations

from collections.abc import Iterable

import bpy
import numpy as np
from mathutils import Matrix
from mathutils.kdtree import KDTree

from ..core.base.arrays import Boolean, Float
from ..core.sensing.recordings.comparison import Change
from ..core.sensing.recordings.verification import Verification
from ..core.sensing.scans.sensor import MountedSensor
from ..core.site.scene_geometry import FROM_SURVEY
from ..core.workflows.verifying import box_triangles
from . import contract
from .read import Shown, shown_parts
from .sensors import labelled_sensors

_SAME_CORNER = 1e-6  # metres: corners that are computed twice differ by rounding only


def correct_scene(scene: bpy.types.Scene, found: Verification) -> tuple[str, ...]:
    """Add what a verification found, remove what is gone, and move the sensors to their fitted poses.

    New objects become boxes in ``SEIP Occluders``. An object of which parts are gone keeps its other faces, and its
    modifiers are applied. Children of a removed object stay where they are; its pieces go with it. A second correction
    by the same verification changes nothing.

    Returns
    -------
    tuple of str
        A sentence for each object that cannot be corrected, such as one of a linked collection.
    """
    gone = {change.name for change in found.changes if change.kind == "gone"}
    problems = [*_remove_gone(scene, gone, _corners_by_name(found))]
    for change in found.changes:
        if change.kind == "new":
            _add_box(scene, change)
    sensors = labelled_sensors(scene)
    for one in found.comparisons:
        problems += _move(sensors.get(one.sensor.label), one.sensor)
    return tuple(problems)


def _corners_by_name(found: Verification) -> dict[str, list[Float]]:
    """Return the corners of the corrected occluders, by the names of their objects."""
    corners: dict[str, list[Float]] = {}
    for mesh in found.corrected.occluders:
        corners.setdefault(mesh.name, []).append(mesh.triangles.reshape(-1, 3))
    return corners


def _remove_gone(scene: bpy.types.Scene, gone: set[str], corners: dict[str, list[Float]]) -> list[str]:
    """Remove the parts of objects that are gone, and return a sentence for each object that cannot be changed."""
    if not gone:
        return []
    parts = [part for part in shown_parts(scene, contract.members(scene)) if part.triangles is not None]
    kept = {name: _tree(corners.get(name, [])) for name in gone}
    lost = {id(part): _lost(part, kept[part.name]) for part in parts if part.name in gone and _stands(part)}
    sources = {part.source.session_uid: part.source for part in parts if id(part) in lost and lost[id(part)].any()}
    problems = []
    for source in sources.values():
        own = [part for part in parts if part.source == source]
        whole = all(_stands(part) and id(part) in lost and lost[id(part)].all() for part in own)
        obstacle = _obstacle(scene, source, own, whole=whole)
        if obstacle:
            problems.append(obstacle)
        elif whole:
            _remove(scene, source)
        else:
            _trim(source, kept[source.name])
    return problems


def _stands(part: Shown) -> bool:
    """Return whether a part of a scene is an occluder or a pole, and no surface of the street."""
    return bool(part.collections & {contract.OCCLUDERS, contract.POLES}) and not (
        part.collections & {contract.ROADS, contract.GROUND}
    )


def _tree(corners: Iterable[Float]) -> KDTree:
    points = np.concatenate([np.zeros((0, 3)), *corners])
    tree = KDTree(len(points))
    for number, point in enumerate(np.unique(points, axis=0).tolist()):
        tree.insert(point, number)
    tree.balance()
    return tree


def _is_of(tree: KDTree, points: Float) -> Boolean:
    """Return which points (n, 3) are corners of a tree."""
    found: Boolean = np.array([bool(tree.find_range(point, _SAME_CORNER)) for point in points.tolist()], dtype=bool)
    return found


def _lost(part: Shown, kept: KDTree) -> Boolean:
    """Return which triangles of a part are not in the corrected scene."""
    assert part.triangles is not None  # noqa: S101  # parts without were left out
    there: Boolean = _is_of(kept, part.triangles.reshape(-1, 3)).reshape(-1, 3)
    lost: Boolean = ~there.all(axis=1)
    return lost


def _obstacle(scene: bpy.types.Scene, source: bpy.types.Object, parts: list[Shown], *, whole: bool) -> str:
    """Return why an object cannot be corrected, as a sentence, or ""."""
    fixed = [one for one in _collections_of(scene, source) if one.library or one.override_library]
    linked = fixed or (not whole and (source.library or source.override_library))
    if linked:
        library = source.library or next((one.library for one in fixed if one.library), None)
        origin = f"{library.filepath}" if library else "another file"
        return (
            f"{source.name!r} has changed, but is linked from {origin}: correct it there, or make it local and verify "
            "again"
        )
    if not whole and source.type not in {"MESH", "EMPTY"}:
        return f"a part of {source.name!r} is no longer there: convert it to a mesh (Object ▸ Convert) and verify again"
    if not whole and any(part.name != source.name for part in parts):
        return (
            f"a part of the instances of {source.name!r} is no longer there: make its instances real (Object ▸ Apply ▸ "
            "Make Instances Real) and verify again"
        )
    return ""


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


def _trim(obj: bpy.types.Object, kept: KDTree) -> None:
    """Give an object a mesh of its own with those of its faces whose corners are kept."""
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = bpy.data.meshes.new_from_object(evaluated)
    mesh.name = obj.name
    local = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", local)
    matrix = np.array(evaluated.matrix_world, dtype=np.float64)
    there = _is_of(kept, local.reshape(-1, 3).astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3])
    keep_vertices(mesh, there)
    obj.modifiers.clear()
    obj.data = mesh


def keep_vertices(mesh: bpy.types.Mesh, there: Boolean) -> None:
    """Delete all vertices of a mesh but some, with their faces."""
    import bmesh  # noqa: PLC0415  # only Blender has it, and only here it is needed

    edited = bmesh.new()
    edited.from_mesh(mesh)
    edited.verts.ensure_lookup_table()
    others = [edited.verts[number] for number in np.flatnonzero(~there).tolist()]
    bmesh.ops.delete(edited, geom=others, context="VERTS")
    edited.to_mesh(mesh)
    edited.free()
    mesh.update()


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
