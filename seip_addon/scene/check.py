"""Contents of a scene for the site check, faults included."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import bpy
import numpy as np

from ..core.base.arrays import Float
from ..core.base.counts import counted
from ..core.base.errors import SeipError
from ..core.site.check import Problem, SceneContents, Surface
from ..core.site.roles import Role
from ..core.site.scene_geometry import SceneGeometry
from . import contract, roles
from .named_places import places_of
from .read import (
    Shown,
    area_of,
    check_units,
    foot_sentences,
    geo_reference_of,
    geometry_of,
    hidden_members,
    hidden_sentence,
    missing_libraries,
    origin_of,
    poles_of,
    rule_fault,
    shown_parts,
)

ROLES = {collection: role.name.lower() for role, collection in roles.ROLES.items() if role is not Role.POLES}
"""Collections of surfaces, and the role that they give."""
NAMED_AREAS = (contract.WEIGHTED_REGIONS, contract.FORBIDDEN_AREAS, contract.MANDATORY_AREAS)
NEVER_IN_THE_WAY = {contract.SENSORS, contract.COVERAGE, contract.TRAFFIC, "Dressing"}
"""Collections whose objects need no role."""
LARGE = 2.0
"""Metres of height, and across, from which an object in no role could have been meant to stand in the way."""
NEAR = 50.0
"""Metres from what has a role within which it could."""
MOST_NAMED = 5


def contents_of(scene: bpy.types.Scene) -> SceneContents:
    """Read all that a scene shows of its collections, and collect the problems that show on the way."""
    members = contract.members(scene)
    problems = [Problem("ERROR", text, name) for name, text in missing_libraries(scene, members).items()]
    parts = list(shown_parts(scene, members))
    hidden = hidden_members(scene, members)
    problems += [*_faults(parts), *_odd_scene(scene)]
    problems += [Problem("WARNING", _sentence(hidden_sentence(name, all_))) for name, all_ in hidden.items()]
    problems += [Problem("WARNING", _sentence(text)) for text in foot_sentences(_finite(parts))]
    surfaces = tuple(
        Surface(ROLES[name], part.source.name, part.triangles)
        for part in parts
        for name in sorted(part.collections & ROLES.keys())
        if part.triangles is not None
    )
    problems += _without_role(scene, members, surfaces)
    geometry, complaint = _geometry(scene, parts)
    built = frozenset(part.source.name for part in parts if part.source.get(contract.SOURCE))
    return SceneContents(surfaces, poles_of(_finite(parts)), geometry, tuple(problems), complaint, built)


def _geometry(scene: bpy.types.Scene, parts: list[Shown]) -> tuple[SceneGeometry | None, str]:
    """Return what a survey would read, or its complaint."""
    try:
        return geometry_of(scene, parts, {}).geometry, ""
    except SeipError as error:
        return None, str(error)


def _faults(parts: list[Shown]) -> Iterator[Problem]:
    """Find objects that cannot be what their collection says."""
    instancers = {part.source for part in parts if part.triangles is not None}
    for part in parts:
        surfaces = part.collections & ROLES.keys()
        fault = part.fault or rule_fault(part)
        if fault:
            yield _error(fault, part)
        elif part.triangles is None and surfaces and part.source not in instancers:
            yield _error(f"{part.name!r} in {min(surfaces)!r} has no faces: give it some or take it out", part)
        for name in NAMED_AREAS:
            if name in part.collections and part.triangles is not None:
                yield from _area_complaints(part, name)
    for part in parts:
        if contract.POLES in part.collections and not np.isfinite(part.matrix).all() and not part.fault:
            yield _error(f"pole {part.name!r} stands at a place that is no finite number: set its location", part)


def _area_complaints(part: Shown, collection: str) -> Iterator[Problem]:
    try:
        area_of(part, collection)
    except SeipError as error:
        yield _error(str(error), part)


def _error(text: str, part: Shown) -> Problem:
    return Problem("ERROR", _sentence(text), part.source.name)


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}." if not text.endswith(".") else text


def _finite(parts: list[Shown]) -> list[Shown]:
    return [part for part in parts if np.isfinite(part.matrix).all()]


def _odd_scene(scene: bpy.types.Scene) -> Iterator[Problem]:
    for read in (check_units, origin_of, geo_reference_of, places_of):
        try:
            read(scene)
        except SeipError as error:
            yield Problem("ERROR", _sentence(str(error)))


def _without_role(
    scene: bpy.types.Scene, members: dict[str, set[bpy.types.Object]], surfaces: Iterable[Surface]
) -> Iterator[Problem]:
    """Find large objects near the site that no ray would end on."""
    corners = [surface.triangles.reshape(-1, 3)[:, :2] for surface in surfaces if surface.role in {"region", "roads"}]
    if not corners:
        return
    low = np.min([corner.min(axis=0) for corner in corners], axis=0) - NEAR
    high = np.max([corner.max(axis=0) for corner in corners], axis=0) + NEAR
    placed = set().union(*members.values())
    large = []
    for obj in scene.view_layers[0].objects:
        if obj in placed or obj.type != "MESH" or _needs_no_role(obj) or not obj.visible_get():
            continue
        box = _box(obj)
        size = np.ptp(box, axis=0)
        near = (box[:, :2].max(axis=0) > low).all() and (box[:, :2].min(axis=0) < high).all()
        if near and size[2] >= LARGE and size[:2].max() >= LARGE:
            large.append((float(size.max()), obj.name))
    for size, name in sorted(large, reverse=True)[:MOST_NAMED]:
        yield Problem(
            "WARNING",
            f"{name!r}, {size:.0f} m large, has no role: no ray ends on it; assign it to the occluders if it stands "
            "in the way.",
            name,
        )
    if len(large) > MOST_NAMED:
        more = counted(len(large) - MOST_NAMED, "more large object has", "more large objects have")
        yield Problem("WARNING", f"{more} no role: no ray ends there.")


def _needs_no_role(obj: bpy.types.Object) -> bool:
    return obj.display_type in {"BOUNDS", "WIRE"} or any(
        contract.base_name(collection) in NEVER_IN_THE_WAY for collection in obj.users_collection
    )


def _box(obj: bpy.types.Object) -> Float:
    """Return the corners (8, 3) of an object's bounding box in site axes."""
    matrix = np.array(obj.matrix_world, dtype=np.float64)
    box: Float = np.array(obj.bound_box, dtype=np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    return box
