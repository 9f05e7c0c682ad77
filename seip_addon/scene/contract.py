"""Names of collections and custom properties in the scene contract, which docs/scene-contract.md describes.

`tests/scene/test_read.py` shows its use.
"""

from __future__ import annotations

import re

import bpy

REGION = "SEIP Region"
ROADS = "SEIP Roads"
GROUND = "SEIP Ground"
OCCLUDERS = "SEIP Occluders"
POLES = "SEIP Poles"
CANDIDATE_AREAS = "SEIP Candidate Areas"
WEIGHTED_REGIONS = "SEIP Weighted Regions"
FORBIDDEN_AREAS = "SEIP Forbidden Areas"
MANDATORY_AREAS = "SEIP Mandatory Areas"
SENSORS = "SEIP Sensors"
COVERAGE = "SEIP Coverage"
TRAFFIC = "SEIP Traffic"

AREAS = (REGION, CANDIDATE_AREAS, WEIGHTED_REGIONS, FORBIDDEN_AREAS, MANDATORY_AREAS)
"""Collections whose objects outline areas in plan."""
INPUTS = (*AREAS, ROADS, GROUND, OCCLUDERS, POLES)
"""Collections that a site is read from. `SENSORS` and `COVERAGE` are written; `TRAFFIC` is read and written."""

WEIGHT = "seip_weight"
FORBIDDEN = "seip_forbidden"
MANDATORY = "seip_mandatory"
KEEP_OFF = "seip_keep_off"
SOURCE = "seip_source"
HEIGHT_ASSUMED = "seip_height_assumed"
WIDTH_ASSUMED = "seip_width_assumed"
TITLE = "seip_title"
ORIGIN = "seip_origin"
MAP = "seip_map"
GEO_REFERENCE = "seip_geo_reference"
REFLECTIVITY = "seip_reflectivity"
SENSOR = "seip_sensor"
LABEL = "seip_label"
BEAMS = "seip_beams"
POSITION = "seip_position"
PIECE_OF = "seip_piece_of"
HEADER_OFFSET = "seip_header_offset"
PLACES = "seip_places"
ATTRIBUTION = "seip_attribution"
ASSUMPTIONS = "seip_assumptions"
CATEGORY = "seip_category"
PAINT = "seip_paint"
SHAPE = "seip_shape"
PLACEMENT = "seip_placement"
"""On a scene: the placement that a command has written, which the panel takes over; see `result_folder`."""
BUILT = "seip_built"
"""Mark of every object that was built from a map; on a scene, the place on that map."""
WRITTEN = "seip_result"
"""Mark of every object that this program writes as a result or from trajectories. The next ones replace only these."""

NUMBER = re.compile(r"\.\d{3,}$")
"""Number that Blender appends to a name that exists already, as in ``SEIP Roads.001``."""


def base_name(collection: bpy.types.Collection) -> str:
    """Return the name of a collection without the number that Blender adds if another scene has the same name."""
    return NUMBER.sub("", collection.name)


def find(scene: bpy.types.Scene, name: str) -> bpy.types.Collection | None:
    """Return the scene's own collection of that name, anywhere below its root, or None."""
    below = scene.collection.children_recursive
    own = (collection for collection in below if collection.library is None and base_name(collection) == name)
    return next(own, None)


def find_or_make(scene: bpy.types.Scene, name: str) -> bpy.types.Collection:
    """Return the scene's own collection of that name, created below the root if it is missing."""
    collection = find(scene, name)
    if collection is None:
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
    return collection


def leave_shared(scene: bpy.types.Scene, name: str) -> None:
    """Unlink a scene's collection if other scenes have it too, as after Blender's Linked Copy."""
    top = scene.collection.children
    shared = find(scene, name)
    others = (other for other in bpy.data.scenes if other != scene)
    if shared is not None and shared.name in top and any(find(other, name) == shared for other in others):
        top.unlink(shared)


def has_members(scene: bpy.types.Scene, name: str) -> bool:
    """Return whether the collections of a name, which may be several, contain an object."""
    return any(base_name(collection) == name and len(collection.all_objects) > 0 for collection in _reached(scene))


def members(scene: bpy.types.Scene) -> dict[str, set[bpy.types.Object]]:
    """Return the objects of each collection in `INPUTS`.

    This includes linked collections below the scene's root, and collections within those that objects instance.
    """
    found: dict[str, set[bpy.types.Object]] = {name: set() for name in INPUTS}
    for collection in _reached(scene):
        if base_name(collection) in found:
            found[base_name(collection)].update(collection.all_objects)
    return found


def _reached(scene: bpy.types.Scene) -> set[bpy.types.Collection]:
    """Return the collections below the scene's root and, at any depth, within instanced ones."""
    # Objects can instance collections that contain other instances. Each collection is visited once, also if it can be
    # reached in several ways.
    reached = {scene.collection}
    waiting = [scene.collection]
    while waiting:
        collection = waiting.pop()
        instanced = {obj.instance_collection for obj in collection.objects if obj.instance_type == "COLLECTION"}
        following = {*collection.children, *instanced} - reached - {None}
        reached |= following
        waiting += following
    return reached
