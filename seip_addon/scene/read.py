"""Scene to arrays: evaluated meshes by collection, as docs/architecture.md names them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import bpy
import numpy as np

from ..core.arrays import Float
from ..core.candidates import plan_outline
from ..core.errors import SeipError
from ..core.scene_geometry import Mesh, NamedArea, Pole, SceneGeometry
from . import collections as names

_SURFACES = {"MESH", "CURVE", "SURFACE", "META", "FONT"}
"""Types of object that Blender can turn into faces."""


@dataclass(frozen=True)
class SceneReading:
    """What was read from a scene, and what a user should know of it.

    Parameters
    ----------
    geometry : SceneGeometry
    warnings : tuple of str
        One sentence each.
    """

    geometry: SceneGeometry
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class _Part:
    """One object or instance as the viewport shows it."""

    name: str
    collections: frozenset[str]
    matrix: Float
    triangles: Float | None
    source: bpy.types.Object


def read_scene(scene: bpy.types.Scene) -> SceneReading:
    """Read the collections of the scene contract into plain geometry.

    What the viewport would show counts: modifiers, parents, instances and
    linked collections included, hidden objects not. The scene is not changed.

    Parameters
    ----------
    scene : bpy.types.Scene

    Returns
    -------
    SceneReading

    Raises
    ------
    SeipError
        The region or the road is missing; an object that must have faces has
        none, has a coordinate that is no number, or has no area at all.
    """
    members = _members()
    parts = list(_parts(scene, members))
    region = plan_outline(_meshes(parts, names.REGION))
    if region.is_empty:
        raise SeipError(
            f"scene {scene.name!r} has no region of interest: "
            f"put a mesh that covers the road to be watched into the collection {names.REGION!r}"
        )
    roads = _meshes(parts, names.ROADS)
    if not roads:
        raise SeipError(
            f"scene {scene.name!r} has no road: put the meshes of the carriageway into the collection {names.ROADS!r}"
        )
    # An object that lies in several collections is cast against once.
    taken = {id(part) for part in parts if names.ROADS in part.collections}
    ground = _meshes([p for p in parts if id(p) not in taken], names.GROUND)
    taken |= {id(part) for part in parts if names.GROUND in part.collections}
    free = [part for part in parts if id(part) not in taken]
    poles_with_faces = [p for p in free if names.OCCLUDERS not in p.collections and p.triangles is not None]
    geometry = SceneGeometry(
        name=str(scene.get(names.TITLE, scene.name)),
        origin=_origin(scene),
        roads=roads,
        ground=ground,
        occluders=_meshes(free, names.OCCLUDERS) + _meshes(poles_with_faces, names.POLES),
        region=region,
        candidate_areas=plan_outline(_meshes(parts, names.CANDIDATE_AREAS)),
        weighted_regions=_areas(parts, names.WEIGHTED_REGIONS),
        forbidden_areas=_areas(parts, names.FORBIDDEN_AREAS),
        mandatory_areas=_areas(parts, names.MANDATORY_AREAS),
        poles=_poles(parts),
    )
    return SceneReading(geometry, _hidden(scene, members))


def _members() -> dict[str, set[bpy.types.Object]]:
    """Objects of each collection of the contract; linked collections may share a name with local ones."""
    members: dict[str, set[bpy.types.Object]] = {name: set() for name in names.INPUTS}
    for collection in bpy.data.collections:
        if collection.name in members:
            members[collection.name].update(collection.all_objects)
    return members


def _parts(scene: bpy.types.Scene, members: dict[str, set[bpy.types.Object]]) -> Iterator[_Part]:
    depsgraph = _depsgraph(scene)
    faces: dict[int, Float | None] = {}
    counts: dict[str, int] = {}
    for instance in depsgraph.object_instances:
        shown = instance.object
        owners = [shown.original]
        if instance.is_instance:
            owners.append(instance.parent.original)
        found = frozenset(name for name, objects in members.items() if not objects.isdisjoint(owners))
        if not found or (not instance.is_instance and not instance.show_self):
            continue
        name = owners[-1].name
        if instance.is_instance:
            counts[name] = counts.get(name, 0) + 1
            name = f"{name} {counts[name]}"
        if shown.type != "MESH":
            local = _local_triangles(shown)
        else:  # instances and copies share one evaluated mesh
            key = shown.data.as_pointer()
            if key not in faces:
                faces[key] = _local_triangles(shown)
            local = faces[key]
        matrix = np.array(instance.matrix_world, dtype=np.float64)
        yield _Part(name, found, matrix, None if local is None else _place(local, matrix, name), owners[-1])


def _depsgraph(scene: bpy.types.Scene) -> bpy.types.Depsgraph:
    layer = scene.view_layers[0]
    layer.update()
    return layer.depsgraph


def _local_triangles(evaluated: bpy.types.Object) -> Float | None:
    """(n, 3, 3) corners in the object's own axes, or None where it has no faces to give."""
    if evaluated.type not in _SURFACES:
        return None
    mesh = evaluated.data if evaluated.type == "MESH" else evaluated.to_mesh()
    if mesh is None or not len(mesh.loop_triangles):
        return None
    corners = np.empty(len(mesh.loop_triangles) * 3, dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    places = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.vertices.foreach_get("co", places)
    if evaluated.type != "MESH":
        evaluated.to_mesh_clear()
    return places.reshape(-1, 3).astype(np.float64)[corners].reshape(-1, 3, 3)


def _place(local: Float, matrix: Float, name: str) -> Float:
    """Corners in site axes without the triangles that have no area."""
    world = local @ matrix[:3, :3].T + matrix[:3, 3]
    if not np.isfinite(world).all():
        raise SeipError(f"object {name!r} has a vertex or transform that is no finite number: repair or delete it")
    area = np.linalg.norm(np.cross(world[:, 1] - world[:, 0], world[:, 2] - world[:, 0]), axis=1) / 2
    solid = area > 0
    if not solid.any():
        raise SeipError(f"object {name!r} has only faces of zero area: scale it up, repair it or delete it")
    kept: Float = world[solid]
    return kept


def _meshes(parts: list[_Part], collection: str) -> tuple[Mesh, ...]:
    meshes = []
    instancers = {part.source for part in parts if part.triangles is not None}
    for part in parts:
        if collection not in part.collections:
            continue
        if part.triangles is not None:
            meshes.append(Mesh(part.name, part.triangles))
        elif part.source not in instancers and collection != names.POLES:
            raise SeipError(
                f"object {part.name!r} in {collection!r} has no mesh: give it faces or take it out of the collection"
            )
    return tuple(meshes)


def _areas(parts: list[_Part], collection: str) -> tuple[NamedArea, ...]:
    areas = []
    for part in parts:
        if collection in part.collections:
            (mesh,) = _meshes([part], collection)
            outline = plan_outline([mesh])
            if outline.is_empty:
                raise SeipError(f"object {part.name!r} in {collection!r} covers no area in plan: lay it flat")
            areas.append(NamedArea(part.name, outline, _weight(part)))
    return tuple(areas)


def _weight(part: _Part) -> float:
    weight = part.source.get(names.WEIGHT, names.DEFAULT_WEIGHT)
    if isinstance(weight, bool) or not isinstance(weight, int | float):
        raise SeipError(f"property {names.WEIGHT} of object {part.name!r} must be a number, not {weight!r}")
    return float(weight)


def _poles(parts: list[_Part]) -> tuple[Pole, ...]:
    return tuple(
        Pole(
            part.name,
            _finite_foot(part),
            forbidden=bool(part.source.get(names.FORBIDDEN, False)),
            mandatory=bool(part.source.get(names.MANDATORY, False)),
        )
        for part in parts
        if names.POLES in part.collections
    )


def _finite_foot(part: _Part) -> Float:
    foot: Float = part.matrix[:3, 3]
    if not np.isfinite(foot).all():
        raise SeipError(f"pole {part.name!r} stands at a place that is no finite number: set its location")
    return foot


def _origin(scene: bpy.types.Scene) -> Float:
    stored = scene.get(names.ORIGIN, (0.0, 0.0, 0.0))
    try:
        values = [float(value) for value in stored]
    except TypeError:
        values = []
    if len(values) != 3 or not all(map(math.isfinite, values)):
        raise SeipError(f"scene property {names.ORIGIN} must be three finite numbers (metres), not {stored!r}")
    return np.array(values)


def _hidden(scene: bpy.types.Scene, members: dict[str, set[bpy.types.Object]]) -> tuple[str, ...]:
    """Say which collections hold objects that the viewport does not show."""
    layer = scene.view_layers[0]
    warnings = []
    for name, objects in members.items():
        count = sum(1 for item in objects if item.name in layer.objects and not item.visible_get(view_layer=layer))
        if count:
            warnings.append(
                f"{count} hidden object{'s' * (count > 1)} in {name!r} did not count: show them if they should"
            )
    return tuple(warnings)
