"""Traffic in the scene: road users as animated objects, and animated objects as trajectories."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

import bpy
import numpy as np

from ..core.base.arrays import Float
from ..core.base.errors import SeipError
from ..core.base.progress import Progress
from ..core.geometry.solids import Solid
from ..core.sensing.traffic.bodies import Body, colour_of, fitted_body
from ..core.sensing.traffic.trajectories import CATEGORIES, MAX_BEND, RoadUser, Trajectories, is_shape
from . import contract
from .meshes import mesh_of
from .read import origin_of

LAST_FRAME = 1048574
"""Blender's timeline ends here."""
FRAME_DECIMALS = 4
"""Frames are rounded to these, or a sample at a whole frame might come to lie beside it."""
CONSTANT, LINEAR, VECTOR_HANDLE = 0, 1, 2  # as Blender numbers them
ROUNDED_TO = 4  # decimals of a size in metres: Blender's coordinates are single precision


def animate(scene: bpy.types.Scene, trajectories: Trajectories) -> tuple[bpy.types.Object, ...]:
    """Put road users into the scene as animated objects, in place of those of an earlier call.

    They stand in the collection ``SEIP Traffic``; those of one category, size,
    shape and colour share a mesh. Time 0 is frame 0 at the scene's own frame rate;
    every sample is a keyframe where it falls, between two frames as well, with
    straight lines from one to the next. Before its first and after its last
    sample a road user is hidden. The scene's frame range becomes the
    trajectories' span. Nothing else that this function did not make is changed.

    Parameters
    ----------
    trajectories : Trajectories
        In any origin; they are put into the scene's.

    Returns
    -------
    tuple of bpy.types.Object
        One for each road user, in their order.

    Raises
    ------
    SeipError
        A road user has no size, or the trajectories end after Blender's last frame.
    """
    frames = np.round(trajectories.time * _frame_rate(scene), FRAME_DECIMALS)
    if frames.min() < 0 or frames.max() > LAST_FRAME:
        raise SeipError(
            f"the traffic is from {trajectories.span[0]:g} s to {trajectories.span[1]:g} s, and at the scene's frame "
            f"rate Blender's timeline from 0 s to {LAST_FRAME / _frame_rate(scene):.0f} s: shift the traffic's times"
        )
    bodies = [fitted_body(user) for user in trajectories.users]
    clear_traffic(scene)
    moved = trajectories.moved_to(origin_of(scene))
    collection = contract.find(scene, contract.TRAFFIC) or _new_collection(scene)
    meshes: dict[tuple[object, ...], bpy.types.Mesh] = {}
    objects = []
    for number, (user, body) in enumerate(zip(moved.users, bodies, strict=True)):
        samples = slice(int(moved.first[number]), int(moved.first[number + 1]))
        obj = _road_user(user, _shared_mesh(meshes, user, body))
        _keyframe(obj, frames[samples], moved, samples)
        collection.objects.link(obj)
        objects.append(obj)
    _show_span(scene, frames)
    return tuple(objects)


def clear_traffic(scene: bpy.types.Scene) -> None:
    """Remove all that `animate` made: objects, meshes, actions, materials, and the collection if it is empty."""
    collection = contract.find(scene, contract.TRAFFIC)
    if collection is None:
        return
    objects = [obj for obj in collection.objects if contract.WRITTEN in obj]
    actions = {obj.animation_data.action for obj in objects if obj.animation_data} - {None}
    meshes = {obj.data for obj in objects}
    materials = {material for mesh in meshes for material in mesh.materials if material}
    bpy.data.batch_remove(objects)
    for owned in (actions, meshes, materials):  # what a user has put to another use stays
        bpy.data.batch_remove([data for data in owned if not data.users])
    if contract.WRITTEN in collection and not collection.all_objects and not collection.children:
        bpy.data.collections.remove(collection)


def read_traffic(scene: bpy.types.Scene) -> Generator[Progress, None, Trajectories]:
    """Return how the objects in ``SEIP Traffic`` move, seen at each whole frame of the scene's frame range.

    Every object there that has no parent there is a road user, with all that
    it carries: children, instances. It counts while the viewport shows it; one
    that comes back counts as another. Its local x axis points forward.

    Parameters
    ----------
    scene : bpy.types.Scene
        Is left at the frame it was at.

    Yields
    ------
    Progress
        Frames read, of all.

    Returns
    -------
    Trajectories
        At the times of the frames, in the scene's origin; sizes from bounding boxes.

    Raises
    ------
    SeipError
        There is no road user, or one without a category or faces.
    """
    collection = contract.find(scene, contract.TRAFFIC)
    members = set(collection.all_objects) if collection else set()
    roots = sorted((obj for obj in members if obj.parent not in members), key=lambda obj: obj.name)
    categories = [_category(root) for root in roots]
    if not roots:
        raise SeipError(
            f"scene {scene.name!r} has no traffic: name a file of trajectories, "
            f"or put animated vehicles into the collection {contract.TRAFFIC!r}"
        )
    tracks: list[list[_Run]] = [[] for _ in roots]
    boxes: dict[bpy.types.Object, Float] = {}
    count = scene.frame_end - scene.frame_start + 1
    with _same_frame_afterwards(scene):
        for done in range(count):
            yield Progress(done, count, "frames")
            frame = scene.frame_start + done
            scene.frame_set(frame)
            shown = [root.visible_get(view_layer=scene.view_layers[0]) for root in roots]
            newcomers = [root for root, there in zip(roots, shown, strict=True) if there and root not in boxes]
            if newcomers:
                boxes |= _boxes(scene, newcomers)
            for root, there, runs in zip(roots, shown, tracks, strict=True):
                if there:
                    _extend(runs, frame, np.array(root.matrix_world, dtype=np.float64))
    yield Progress(count, count, "frames")
    users: list[RoadUser] = []
    motions: list[tuple[Float, ...]] = []
    for root, category, own in zip(roots, categories, tracks, strict=True):
        users += [_described(root, category, boxes[root], number) for number in range(1, len(own) + 1)]
        motions += [_motion(run, boxes[root], _frame_rate(scene)) for run in own]
    if not motions:
        raise SeipError(
            f"no object in {contract.TRAFFIC!r} is shown at any frame from {scene.frame_start} to {scene.frame_end}: "
            "show them, or set the scene's frame range"
        )
    return _joined(users, motions, origin_of(scene), f"animation of scene {scene.name!r}")


def _frame_rate(scene: bpy.types.Scene) -> float:
    return float(scene.render.fps / scene.render.fps_base)


def _new_collection(scene: bpy.types.Scene) -> bpy.types.Collection:
    collection = contract.find_or_make(scene, contract.TRAFFIC)
    collection[contract.WRITTEN] = True
    return collection


def _show_span(scene: bpy.types.Scene, frames: Float) -> None:
    scene.frame_start, scene.frame_end = math.floor(frames.min()), math.ceil(frames.max())
    now = min(max(scene.frame_current, scene.frame_start), scene.frame_end)
    scene.frame_set(now)  # else road users would stand nowhere until somebody moves through time


def _shared_mesh(meshes: dict[tuple[object, ...], bpy.types.Mesh], user: RoadUser, body: Body) -> bpy.types.Mesh:
    """Return the mesh of a body, made where no road user before has had it."""
    shape = (user.category, user.length, user.width, user.height, colour_of(user.paint), user.shape)
    if shape not in meshes:
        vertices, corners = np.unique(body.triangles.reshape(-1, 3), axis=0, return_inverse=True)
        faces = tuple(map(tuple, corners.reshape(-1, 3).tolist()))
        size = " × ".join(f"{side:.4g}" for side in shape[1:4])
        mesh = mesh_of(f"{user.category} {size} {shape[4]}", Solid(vertices, faces, tuple(body.material.tolist())))
        meshes[shape] = mesh
    return meshes[shape]


def _road_user(user: RoadUser, mesh: bpy.types.Mesh) -> bpy.types.Object:
    obj = bpy.data.objects.new(user.name, mesh)
    obj[contract.WRITTEN] = True
    obj[contract.CATEGORY] = user.category
    obj[contract.PAINT] = user.paint
    if any(user.shape):
        obj[contract.SHAPE] = user.shape
    return obj


def _keyframe(obj: bpy.types.Object, frames: Float, motion: Trajectories, samples: slice) -> None:
    """Give an object an action: where it is, how it is turned, and when it is there."""
    action = bpy.data.actions.new(obj.name)
    slot = action.slots.new(id_type="OBJECT", name=obj.name)
    strip = action.layers.new("Traffic").strips.new(type="KEYFRAME")
    curves = strip.channelbag(slot, ensure=True).fcurves
    for axis in range(3):
        _add_curve(curves, "location", axis, frames, motion.position[samples, axis])
    _add_curve(curves, "rotation_euler", 1, frames, -motion.pitch[samples])  # about y, which points left: nose down
    _add_curve(curves, "rotation_euler", 2, frames, motion.yaw[samples])
    gone = (frames[-1] + math.floor(frames[-1]) + 1) / 2  # before the next whole frame
    there = np.array([frames[0] - 1.0, frames[0], gone])
    for path in ("hide_viewport", "hide_render"):
        _add_curve(curves, path, 0, there, np.array([1.0, 0.0, 1.0]), CONSTANT)
    data = obj.animation_data_create()
    data.action = action
    data.action_slot = slot


def _add_curve(
    curves: bpy.types.bpy_prop_collection,
    path: str,
    axis: int,
    frames: Float,
    values: Float,
    interpolation: int = LINEAR,
) -> None:
    if (values == values[0]).all():  # on a level road most heights and pitches are
        frames, values = frames[:1], values[:1]
    curve = curves.new(path, index=axis)
    curve.keyframe_points.add(len(frames))
    keys = curve.keyframe_points
    keys.foreach_set("co", np.column_stack([frames, values]).astype(np.float32).ravel())
    keys.foreach_set("interpolation", np.full(len(frames), interpolation, dtype=np.int32))
    for handle in ("handle_left_type", "handle_right_type"):
        keys.foreach_set(handle, np.full(len(frames), VECTOR_HANDLE, dtype=np.int32))
    curve.update()


@dataclass
class _Run:
    """Successive frames at which an object is shown, and its matrices at them."""

    first: int
    matrices: list[Float] = field(default_factory=list)


def _extend(runs: list[_Run], frame: int, matrix: Float) -> None:
    if not runs or runs[-1].first + len(runs[-1].matrices) != frame:
        runs.append(_Run(frame))
    runs[-1].matrices.append(matrix)


@contextmanager
def _same_frame_afterwards(scene: bpy.types.Scene) -> Iterator[None]:
    frame, part = scene.frame_current, scene.frame_subframe
    try:
        yield
    finally:
        scene.frame_set(frame, subframe=part)


def _category(obj: bpy.types.Object) -> str:
    category = obj.get(contract.CATEGORY)
    if category not in CATEGORIES:
        found = "has no" if category is None else f"has {category!r} as its"
        raise SeipError(
            f"object {obj.name!r} in {contract.TRAFFIC!r} {found} custom property {contract.CATEGORY!r}: "
            f"set it to one of {', '.join(CATEGORIES)}"
        )
    return str(category)


def _boxes(scene: bpy.types.Scene, roots: Sequence[bpy.types.Object]) -> dict[bpy.types.Object, Float]:
    """Return the bounding box of each of the objects and all it carries, (2, 3) in its axes, as it stands now."""
    corners: dict[bpy.types.Object, list[Float]] = {root: [] for root in roots}
    for instance in scene.view_layers[0].depsgraph.object_instances:
        shown = instance.object
        carrier = instance.parent.original if instance.is_instance else shown.original
        while carrier is not None and carrier not in corners:
            carrier = carrier.parent
        if carrier is not None and shown.type == "MESH" and len(shown.data.polygons):
            matrix = np.array(instance.matrix_world, dtype=np.float64)
            corners[carrier].append(np.array(shown.bound_box) @ matrix[:3, :3].T + matrix[:3, 3])
    boxes = {}
    for root, found in corners.items():
        if not found:
            raise SeipError(f"object {root.name!r} in {contract.TRAFFIC!r} has no faces: give it a mesh")
        matrix = np.array(root.matrix_world, dtype=np.float64)
        local = (np.concatenate(found) - matrix[:3, 3]) @ _rotation(matrix)
        boxes[root] = np.array([local.min(axis=0), local.max(axis=0)])
    return boxes


def _rotation(matrix: Float) -> Float:
    """Return the rotation (…, 3, 3) in matrices (…, 4, 4) that may scale as well."""
    axes = matrix[..., :3, :3]
    rotation: Float = axes / np.linalg.norm(axes, axis=-2, keepdims=True)
    return rotation


def _described(root: bpy.types.Object, category: str, box: Float, number: int) -> RoadUser:
    length, width, height = np.round(box[1] - box[0], ROUNDED_TO).tolist()
    name = root.name if number == 1 else f"{root.name} ({number})"
    paint = float(root.get(contract.PAINT, RoadUser.paint))
    return RoadUser(name, category, length, width, height, paint, _shape(root))


def _shape(root: bpy.types.Object) -> tuple[float, float, float, float]:
    given = root.get(contract.SHAPE)
    if given is None:
        return RoadUser.shape
    values = given.to_list() if hasattr(given, "to_list") else [given]
    if not is_shape(values):
        raise SeipError(
            f"object {root.name!r} has {str(values)[:80]} as its custom property {contract.SHAPE!r}: set it to four "
            f"numbers whose first two and last two add up to {MAX_BEND:g} at most, or remove it"
        )
    return tuple(values)


def _motion(run: _Run, box: Float, rate: float) -> tuple[Float, ...]:
    """Return time, position, yaw, pitch and speed over a run of frames."""
    time = (run.first + np.arange(len(run.matrices))) / rate
    matrices = np.array(run.matrices)
    rotation = _rotation(matrices)
    low, high = box
    underside = np.array([*(low[:2] + high[:2]) / 2, low[2]])
    position = matrices[:, :3, 3] + rotation @ underside
    yaw = np.unwrap(np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0]))
    pitch = np.arcsin(np.clip(rotation[:, 2, 0], -1.0, 1.0))
    moving = len(time) > 1
    speed = np.linalg.norm(np.gradient(position, time, axis=0), axis=1) if moving else np.zeros(1)
    return time, position, yaw, pitch, speed


def _joined(users: list[RoadUser], motions: list[tuple[Float, ...]], origin: Float, source: str) -> Trajectories:
    time, position, yaw, pitch, speed = (np.concatenate(parts) for parts in zip(*motions, strict=True))
    first = np.cumsum([0, *(len(motion[0]) for motion in motions)])
    return Trajectories(tuple(users), origin, first, time, position, yaw, pitch, speed, source)
