"""Read a scene into arrays: evaluated meshes by collection.

`tests/scene/test_read.py` shows its use.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ..core.base.arrays import Boolean, Float, Integer
from ..core.base.counts import counted
from ..core.base.errors import SeipError
from ..core.base.limits import LOCAL_COORDINATE, MAP_COORDINATE, WEIGHT
from ..core.geometry.geo_reference import GeoReference
from ..core.geometry.plan import outline
from ..core.site.post_rules import RULES, KeepOffArea, RuleName
from ..core.site.scene_geometry import DEFAULT_WEIGHT, Mesh, NamedArea, Pole, SceneGeometry, joined
from . import contract
from .materials import reflectivity
from .named_places import places_of

SHAFT_REACH = 0.5
"""Metres in plan from a pole's foot within which its faces are its shaft: arms may rise above it."""
FOUNDATION = 0.5
"""Metres that a pole's faces may reach below its origin, as foundations do; beyond, their lowest point is its foot."""
SAME_LEVEL = 0.1
"""Metres above a pole's lowest point within which its faces stand on the ground."""
MOST_NAMED = 3

_KEEPING_OFF = {contract.ROADS, contract.GROUND, contract.FORBIDDEN_AREAS}
"""Collections of which an object may name a rule that keeps new posts off it."""

SURFACES = {"MESH", "CURVE", "SURFACE", "META", "FONT"}
"""Types of object that Blender can turn into faces."""


@dataclass(frozen=True)
class SceneReading:
    """Content of a scene, with notes for the user.

    Parameters
    ----------
    warnings : tuple of str
        One sentence each.
    """

    geometry: SceneGeometry
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Shown:
    """One object or instance as the viewport shows it.

    Parameters
    ----------
    own, collections : frozenset of str
        The collections of the contract that the object itself is in; these and those of its source.
    matrix : (4, 4) float64
        From the object's axes to the site's.
    triangles : (n, 3, 3) float64, metres, or None
        In site axes; None where there are no faces, or faulty ones.
    reflectivity : (n,) float64 or None
        Reflectivity of each triangle.
    source : bpy.types.Object
        What the user put into the scene: the object or what instances it.
    fault : str
        What is wrong with it, as a sentence; empty where nothing is.
    """

    name: str
    own: frozenset[str]
    collections: frozenset[str]
    matrix: Float
    triangles: Float | None
    reflectivity: Float | None
    source: bpy.types.Object
    fault: str = ""


def read_scene(scene: bpy.types.Scene) -> SceneReading:
    """Read the collections of the scene contract into plain geometry.

    What the viewport would show counts: modifiers, parents, instances and
    linked collections included, hidden objects not. The scene is not changed.

    Returns
    -------
    SceneReading

    Raises
    ------
    SeipError
        The scene does not count in metres; the region or the road is missing; an object that must have faces has
        none, has a coordinate that is no number, or has no area at all.
    """
    check_units(scene)
    members = contract.members(scene)
    for sentence in missing_libraries(scene, members).values():
        raise SeipError(sentence)
    return geometry_of(scene, list(shown_parts(scene, members)), hidden_members(scene, members))


def geometry_of(scene: bpy.types.Scene, parts: list[Shown], hidden: dict[str, list[str]]) -> SceneReading:
    """Sort what a scene shows by what it means; see `read_scene`."""
    for part in parts:
        fault = part.fault or rule_fault(part)
        if fault:
            raise SeipError(fault)
    region = outline(joined(_meshes(parts, contract.REGION)))
    if region.is_empty:
        raise SeipError(
            f"scene {scene.name!r} has no region of interest: "
            f"put a mesh that covers the road to be watched into the collection {contract.REGION!r}"
        )
    roads = _meshes(parts, contract.ROADS)
    if not roads:
        raise SeipError(
            f"scene {scene.name!r} has no road: "
            f"put the meshes of the carriageway into the collection {contract.ROADS!r}"
        )
    # An object that lies in several collections is cast against once.
    taken = {id(part) for part in parts if contract.ROADS in part.collections}
    ground = _meshes([p for p in parts if id(p) not in taken], contract.GROUND)
    taken |= {id(part) for part in parts if contract.GROUND in part.collections}
    free = [part for part in parts if id(part) not in taken]
    poles_with_faces = [p for p in free if contract.OCCLUDERS not in p.collections and p.triangles is not None]
    geometry = SceneGeometry(
        name=str(scene.get(contract.TITLE, scene.name)),
        origin=origin_of(scene),
        roads=roads,
        ground=ground,
        occluders=_meshes(free, contract.OCCLUDERS) + _meshes(poles_with_faces, contract.POLES),
        region=region,
        candidate_areas=outline(joined(_meshes(parts, contract.CANDIDATE_AREAS))),
        weighted_regions=_areas(parts, contract.WEIGHTED_REGIONS),
        forbidden_areas=_areas([part for part in parts if _rule(part) is None], contract.FORBIDDEN_AREAS),
        mandatory_areas=_areas(parts, contract.MANDATORY_AREAS),
        poles=poles_of(parts),
        geo_reference=geo_reference_of(scene),
        places=places_of(scene),
        attribution=attribution_of(scene),
        assumptions=_lines(scene, contract.ASSUMPTIONS, "assumption"),
        keep_off_areas=_keep_off_areas(parts),
    )
    hidden_sentences = (hidden_sentence(name, objects) for name, objects in hidden.items())
    return SceneReading(geometry, (*hidden_sentences, *foot_sentences(parts)))


def missing_libraries(scene: bpy.types.Scene, members: dict[str, set[bpy.types.Object]]) -> dict[str, str]:
    """Say of each object which library it lacks, by its name: Blender shows nothing, or a placeholder, in its place."""
    objects = set().union(*members.values())
    instanced = {item.instance_collection for item in objects if item.instance_collection is not None}
    objects.update(*(collection.all_objects for collection in instanced))
    data = {item.data for item in objects if item.data is not None}
    return {
        obj.name: f"{obj.name!r} is linked from {obj.library.filepath}, which is not there: "
        "bring the file back, relocate the library, or delete what is linked from it"
        for obj in (*scene.collection.children_recursive, *instanced, *objects, *data)
        if obj.library is not None and not Path(bpy.path.abspath(obj.library.filepath)).is_file()
    }


def shown_parts(scene: bpy.types.Scene, members: dict[str, set[bpy.types.Object]]) -> Iterator[Shown]:
    """Yield what the viewport shows of the members of collections, faulty objects too."""
    depsgraph = _depsgraph(scene)
    faces: dict[int, _Faces | None] = {}
    counts: dict[str, int] = {}
    for instance in depsgraph.object_instances:
        shown = instance.object
        source = instance.parent.original if instance.is_instance else shown.original
        own = frozenset(name for name, objects in members.items() if shown.original in objects)
        found = own | {name for name, objects in members.items() if source in objects}
        if not found or (not instance.is_instance and not instance.show_self):
            continue
        name = source.name
        if instance.is_instance:
            counts[name] = counts.get(name, 0) + 1
            name = f"{name} {counts[name]}"
        if shown.type != "MESH":
            local = _local_faces(shown)
        else:  # instances and copies share one evaluated mesh
            key = shown.data.as_pointer()
            if key not in faces:
                faces[key] = _local_faces(shown)
            local = faces[key]
        matrix = np.array(instance.matrix_world, dtype=np.float64)
        if local is None:
            yield Shown(name, own, found, matrix, None, None, source)
            continue
        try:
            triangles, solid = _place(local.triangles, matrix, name)
            reflects = _reflectivity(shown, local.material[solid])
        except SeipError as error:
            yield Shown(name, own, found, matrix, None, None, source, str(error))
            continue
        yield Shown(name, own, found, matrix, triangles, reflects, source)


def _depsgraph(scene: bpy.types.Scene) -> bpy.types.Depsgraph:
    layer = scene.view_layers[0]
    layer.update()
    return layer.depsgraph


@dataclass(frozen=True)
class _Faces:
    """(n, 3, 3) corners in the object's own axes, and the material slot (n,) of each triangle."""

    triangles: Float
    material: Integer


def _local_faces(evaluated: bpy.types.Object) -> _Faces | None:
    """Return an object's triangles, or None where it has no faces to give."""
    if evaluated.type not in SURFACES:
        return None
    is_copied = evaluated.type != "MESH" or evaluated.data.is_editmode  # Edit Mode keeps its own mesh, and shows none
    mesh = evaluated.to_mesh() if is_copied else evaluated.data
    if mesh is None:
        return None
    if _is_damaged(mesh):
        raise SeipError(f"object {evaluated.name!r} has damaged faces: repair or delete it")
    if not len(mesh.loop_triangles):
        return None
    corners = np.empty(len(mesh.loop_triangles) * 3, dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    places = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.vertices.foreach_get("co", places)
    material = np.empty(len(mesh.loop_triangles), dtype=np.int32)
    mesh.loop_triangles.foreach_get("material_index", material)
    if is_copied:
        evaluated.to_mesh_clear()
    with np.errstate(invalid="ignore"):  # of numbers that a damaged file holds; they are refused below
        vertices = np.append(places.reshape(-1, 3).astype(np.float64), [[np.nan] * 3], axis=0)
    known = (corners >= 0) & (corners < len(vertices) - 1)  # a damaged file names vertices that are not there
    triangles = vertices[np.where(known, corners, -1)].reshape(-1, 3, 3)
    return _Faces(triangles, material.astype(np.int64))


def _is_damaged(mesh: bpy.types.Mesh) -> bool:
    """Return whether faces lack corners or vertices, so that Blender would crash when it cuts them into triangles."""
    first, count = (np.empty(len(mesh.polygons), dtype=np.int32) for _ in range(2))
    vertex = np.empty(len(mesh.loops), dtype=np.int32)
    try:
        mesh.polygons.foreach_get("loop_start", first)
        mesh.polygons.foreach_get("loop_total", count)
        mesh.loops.foreach_get("vertex_index", vertex)
    except TypeError:  # their arrays are missing
        return True
    end = first.astype(np.int64) + count
    whole = (first >= 0) & (count >= 3) & (end <= len(vertex))
    known = (vertex >= 0) & (vertex < len(mesh.vertices))
    return not (whole.all() and known.all())


def _reflectivity(shown: bpy.types.Object, material: Integer) -> Float:
    """Return the reflectivity of triangles (n,), given their material slots; beyond the last is the last."""
    slots = np.array(
        [reflectivity(slot.material and slot.material.original) for slot in shown.material_slots]
        or [reflectivity(None)]
    )
    shares: Float = slots[np.clip(material, 0, len(slots) - 1)]
    return shares


def _place(local: Float, matrix: Float, name: str) -> tuple[Float, Boolean]:
    """Return the corners in site axes of the triangles that have an area, and which have one."""
    world = local @ matrix[:3, :3].T + matrix[:3, 3]
    if fault := LOCAL_COORDINATE.fault(world):
        raise SeipError(f"object {name!r} has a vertex or transform that {fault}: repair or delete it")
    area = np.linalg.norm(np.cross(world[:, 1] - world[:, 0], world[:, 2] - world[:, 0]), axis=1) / 2
    solid = area > 0
    if not solid.any():
        raise SeipError(f"object {name!r} has only faces of zero area: scale it up, repair it or delete it")
    return world[solid], solid


def _meshes(parts: list[Shown], collection: str) -> tuple[Mesh, ...]:
    meshes = []
    instancers = {part.source for part in parts if part.triangles is not None}
    for part in parts:
        if collection not in part.collections:
            continue
        if part.triangles is not None:
            source = str(part.source.get(contract.SOURCE, ""))
            assumed = (bool(part.source.get(key, False)) for key in (contract.HEIGHT_ASSUMED, contract.WIDTH_ASSUMED))
            meshes.append(Mesh(part.name, part.triangles, part.reflectivity, source, *assumed))
        elif part.source not in instancers and collection != contract.POLES:
            raise SeipError(
                f"object {part.name!r} in {collection!r} has no mesh: give it faces or take it out of the collection"
            )
    return tuple(meshes)


def _areas(parts: list[Shown], collection: str) -> tuple[NamedArea, ...]:
    return tuple(area_of(part, collection) for part in parts if collection in part.collections)


def _keep_off_areas(parts: list[Shown]) -> tuple[KeepOffArea, ...]:
    """Return the areas of the objects that name a rule: surfaces of the street, and areas that are there for it."""
    areas = []
    for part in parts:
        rule = _rule(part)
        if rule is not None and part.collections & _KEEPING_OFF and part.triangles is not None:
            areas.append(KeepOffArea(part.name, outline(part.triangles), rule))
    return tuple(areas)


def _rule(part: Shown) -> RuleName | None:
    """Return the rule that an object names, None where it names none."""
    named = part.source.get(contract.KEEP_OFF)
    return next((rule for rule in RULES if rule == named), None)


def rule_fault(part: Shown) -> str:
    """Return what is wrong with the rule that an object names, or ""."""
    named = part.source.get(contract.KEEP_OFF)
    if named is None or _rule(part) is not None:
        return ""
    known = ", ".join(RULES)
    return f"property {contract.KEEP_OFF} of object {part.name!r} is {named!r}: it must be one of {known}"


def area_of(part: Shown, collection: str) -> NamedArea:
    """Return the area in plan that an object of a collection means.

    Raises
    ------
    SeipError
        It has no faces, covers no area in plan, or its weight is no number.
    """
    (mesh,) = _meshes([part], collection)
    plan = outline(mesh.triangles)
    if plan.is_empty:
        raise SeipError(f"object {part.name!r} in {collection!r} covers no area in plan: lay it flat")
    return NamedArea(part.name, plan, _weight(part))


def _weight(part: Shown) -> float:
    weight = part.source.get(contract.WEIGHT, DEFAULT_WEIGHT)
    if isinstance(weight, bool) or not isinstance(weight, int | float):
        raise SeipError(f"property {contract.WEIGHT} of object {part.name!r} must be a number, not {weight!r}")
    if fault := WEIGHT.fault(weight):
        raise SeipError(f"property {contract.WEIGHT} of object {part.name!r} {fault}: correct it")
    return float(weight)


def poles_of(parts: list[Shown]) -> tuple[Pole, ...]:
    """Return one pole for each member that stands in the scene.

    A collection instance that is a member is one pole at its own foot,
    whatever it is made of. What merely scatters posts, and shows no face of
    its own, is none.
    """
    whole, pieces = _whole_poles(parts)
    return tuple(_pole(part, _corners(part, pieces)) for part in whole)


def foot_sentences(parts: list[Shown]) -> tuple[str, ...]:
    """Say which poles' feet are not at their origins."""
    whole, pieces = _whole_poles(parts)
    off = [
        part.name
        for part in whole
        if not np.array_equal(_finite_origin(part), _foot(_finite_origin(part), _corners(part, pieces)))
    ]
    if not off:
        return ()
    named = ", ".join(map(repr, off[:MOST_NAMED])) + f" and {len(off) - MOST_NAMED} more" * (len(off) > MOST_NAMED)
    what = "pole" if len(off) == 1 else "poles"
    sentence = f"the origin of the {what} {named} is not at the foot: heights are counted from the faces' lowest point"
    return (f"{sentence}; set origins to the feet to choose another",)


def _whole_poles(parts: list[Shown]) -> tuple[list[Shown], list[Shown]]:
    """Return what is a pole of its own, and the pieces that collection instances are made of."""
    members = [part for part in parts if contract.POLES in part.collections]
    pieces = [part for part in members if contract.POLES not in part.own]
    scattered = [part for part in pieces if part.source.instance_type != "COLLECTION"]
    scatterers = {part.source for part in scattered}
    whole = [p for p in members if contract.POLES in p.own and (p.triangles is not None or p.source not in scatterers)]
    return [*whole, *scattered], pieces


def _pole(part: Shown, corners: Float | None) -> Pole:
    foot = _foot(_finite_origin(part), corners)
    return Pole(
        part.name,
        foot,
        None if corners is None else float((_shaft(foot, corners)[:, 2] - foot[2]).max()),
        forbidden=bool(part.source.get(contract.FORBIDDEN, False)),
        mandatory=bool(part.source.get(contract.MANDATORY, False)),
        source=str(part.source.get(contract.SOURCE, "")),
        keep_off=_rule(part),
    )


def _corners(pole: Shown, pieces: list[Shown]) -> Float | None:
    """Return the corners (n, 3) of all that a pole is made of, or None where it has no faces."""
    made_of = [pole] if pole.triangles is not None else [part for part in pieces if part.source == pole.source]
    corners = [part.triangles.reshape(-1, 3) for part in made_of if part.triangles is not None]
    return np.concatenate(corners) if corners else None


def _shaft(foot: Float, corners: Float) -> Float:
    """Return the corners near the axis of a pole; all of them where none is near."""
    near = np.hypot(*(corners - foot)[:, :2].T) <= SHAFT_REACH
    return corners[near] if near.any() else corners


def _foot(origin: Float, corners: Float | None) -> Float:
    """Return the foot of a pole: its origin, unless its faces reach lower or stand elsewhere."""
    if corners is None:
        return origin
    low, high = corners[:, :2].min(axis=0) - SHAFT_REACH, corners[:, :2].max(axis=0) + SHAFT_REACH
    if ((origin[:2] < low) | (origin[:2] > high)).any():
        bottom = corners[corners[:, 2] <= corners[:, 2].min() + SAME_LEVEL]
        return np.append((bottom[:, :2].min(axis=0) + bottom[:, :2].max(axis=0)) / 2, bottom[:, 2].min())
    lowest = float(_shaft(origin, corners)[:, 2].min())
    return np.append(origin[:2], lowest) if lowest < origin[2] - FOUNDATION else origin


def _finite_origin(part: Shown) -> Float:
    origin: Float = part.matrix[:3, 3]
    if fault := LOCAL_COORDINATE.fault(origin):
        raise SeipError(f"a coordinate of pole {part.name!r} {fault}: set its location")
    return origin


def check_units(scene: bpy.types.Scene) -> None:
    """Raise SeipError where one unit of a scene is no metre."""
    units = scene.unit_settings
    if units.system != "NONE" and not math.isclose(units.scale_length, 1.0, rel_tol=1e-6):
        raise SeipError(
            f"one unit of scene {scene.name!r} is {units.scale_length:g} m, but is read as one metre: set Unit Scale "
            "to 1 under Scene ▸ Units, and scale all objects by what it was"
        )


def origin_of(scene: bpy.types.Scene) -> Float:
    """Return the map coordinates (3,) of the scene's local origin, metres."""
    return np.array(_numbers(scene, contract.ORIGIN, ("three", 3), "(metres)"))


def geo_reference_of(scene: bpy.types.Scene) -> GeoReference:
    """Return what the builder of the scene knew of where on the Earth its map is."""
    text = scene.get(contract.GEO_REFERENCE, "")
    if not isinstance(text, str):
        raise SeipError(
            f"scene property {contract.GEO_REFERENCE} must be the text of the map's <geoReference>, not {text!r}"
        )
    x, y, z, heading = _numbers(scene, contract.HEADER_OFFSET, ("four", 4), "(x, y, z in metres, heading in radians)")
    return GeoReference(text, (x, y, z, heading))


def attribution_of(scene: bpy.types.Scene) -> tuple[str, ...]:
    """Return the credits that the sources of a scene demand, one for each line of its property."""
    return _lines(scene, contract.ATTRIBUTION, "credit")


def _lines(scene: bpy.types.Scene, name: str, what: str) -> tuple[str, ...]:
    """Return the lines of a scene's property that are not empty."""
    text = scene.get(name, "")
    if not isinstance(text, str):
        raise SeipError(f"scene property {name} must be a text, one {what} on each line, not {text!r}")
    return tuple(line.strip() for line in text.splitlines() if line.strip())


def _numbers(scene: bpy.types.Scene, name: str, many: tuple[str, int], units: str) -> list[float]:
    """Return the numbers that a property of a scene holds; zeros where there is none."""
    word, count = many
    stored = scene.get(name, (0.0,) * count)
    try:
        values = [] if isinstance(stored, str) else [float(value) for value in stored]
    except (TypeError, ValueError):
        values = []
    if len(values) != count or not MAP_COORDINATE.allow(values):
        raise SeipError(f"scene property {name} must be {word} finite numbers {units}, not {stored!r}")
    return values


def hidden_members(scene: bpy.types.Scene, members: dict[str, set[bpy.types.Object]]) -> dict[str, list[str]]:
    """Return by collection the names of the objects that the viewport does not show."""
    layer = scene.view_layers[0]
    hidden = {
        name: sorted(
            item.name for item in objects if item.name in layer.objects and not item.visible_get(view_layer=layer)
        )
        for name, objects in members.items()
    }
    return {name: objects for name, objects in hidden.items() if objects}


def hidden_sentence(collection: str, hidden: list[str]) -> str:
    """Say that objects of a collection do not count because the viewport does not show them."""
    objects = counted(len(hidden), "hidden object")
    return f"{objects} in {collection!r} did not count: show them if they should"
