"""Roles of objects: their collections in the scene contract."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ..core.base.errors import SeipError
from ..core.site.roles import AREA_OVERLAYS, Role
from . import contract
from .build import COLLECTIONS
from .materials import material
from .read import SURFACES

ROLES = {role: collection for role, collection in COLLECTIONS.items() if collection in contract.INPUTS}
"""The collection of each role that a user may assign."""

WORDS = {
    Role.REGION: "region to be covered, by its outline in plan",
    Role.ROADS: "carriageway, on which the targets are",
    Role.GROUND: "other surfaces: pavements, verges, terrain",
    Role.OCCLUDERS: "objects that block the view: buildings, trees, walls",
    Role.POLES: "posts that can carry a sensor; the origin is the foot, unless faces reach below it",
    Role.CANDIDATE_AREAS: "areas for new posts, usually the pavements",
    Role.WEIGHTED_REGIONS: "areas whose targets count more, by their outline in plan",
    Role.FORBIDDEN_AREAS: "areas without sensors, by their outline in plan",
    Role.MANDATORY_AREAS: "areas with at least one sensor, by their outline in plan",
}
"""Description of each role."""
AREAS = tuple(role for role in ROLES if ROLES[role] in contract.AREAS)
"""Roles whose objects mean an area in plan."""


def roles_of(scene: bpy.types.Scene, obj: bpy.types.Object) -> tuple[Role, ...]:
    """Return the roles that an object is linked to, directly or in a sub-collection."""
    kinds = {
        contract.base_name(collection)
        for collection in scene.collection.children_recursive
        if contract.base_name(collection) in contract.INPUTS and collection.all_objects.get(obj.name) == obj
    }
    return tuple(role for role, collection in ROLES.items() if collection in kinds)


def assign(scene: bpy.types.Scene, objects: Iterable[bpy.types.Object], role: Role) -> int:
    """Link objects to a role's collection, and return how many were not there before.

    Raises
    ------
    SeipError
        None of them can have the role.
    """
    given = list(objects)
    fit = [obj for obj in given if _can_be(obj, role)]
    if not fit:
        wish = "meshes or empties" if role is Role.POLES else "meshes, or empties that instance a collection"
        raise SeipError(f"none of the {len(given)} selected objects can be among the {role.value}: select {wish}")
    new = [obj for obj in fit if role not in roles_of(scene, obj)]
    collection = contract.find_or_make(scene, ROLES[role])
    for obj in new:
        collection.objects.link(obj)
    return len(new)


def take_out(scene: bpy.types.Scene, objects: Iterable[bpy.types.Object], role: Role) -> int:
    """Unlink objects from a role's collections, and return how many were there.

    One that would be in no collection at all is linked to the scene's own.

    Raises
    ------
    SeipError
        None of them has the role by a collection of this file.
    """
    count = 0
    top = [c for c in scene.collection.children_recursive if contract.base_name(c) == ROLES[role]]
    own = {c for collection in top for c in (collection, *collection.children_recursive) if c.library is None}
    for obj in objects:
        linked = [collection for collection in own if obj.name in collection.objects]
        for collection in linked:
            collection.objects.unlink(obj)
        if linked and not obj.users_collection:
            scene.collection.objects.link(obj)
        count += bool(linked)
    if not count:
        raise SeipError(f"none of the selected objects is among the {role.value} of this file: nothing to take out")
    return count


def _can_be(obj: bpy.types.Object, role: Role) -> bool:
    instancer = obj.type == "EMPTY" and obj.instance_collection is not None
    return obj.type in SURFACES or instancer or (obj.type == "EMPTY" and role is Role.POLES)


def add_area(
    scene: bpy.types.Scene,
    role: Role,
    middle: tuple[float, float, float],
    size: tuple[float, float],
) -> bpy.types.Object:
    """Add a flat rectangle in a role, ready to be edited.

    Parameters
    ----------
    role : Role
        One of `AREAS`.
    middle : (3,) float, metres
        Of the area; it is laid a little higher, so as to be seen above the road.
    size : (2,) float, metres
        Along x and y.
    """
    above, shade = AREA_OVERLAYS[role]
    name = role.value.capitalize()
    mesh = bpy.data.meshes.new(name)
    x, y = size[0] / 2, size[1] / 2
    mesh.from_pydata([(-x, -y, 0.0), (x, -y, 0.0), (x, y, 0.0), (-x, y, 0.0)], [], [(0, 1, 2, 3)])
    mesh.materials.append(material(shade))
    obj = bpy.data.objects.new(name, mesh)
    obj.location = (middle[0], middle[1], middle[2] + above)
    obj.hide_render = True
    contract.find_or_make(scene, ROLES[role]).objects.link(obj)
    return obj
