"""The scene contract's names: collections and custom properties, as docs/architecture.md explains them."""

from __future__ import annotations

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

INPUTS = (
    REGION,
    ROADS,
    GROUND,
    OCCLUDERS,
    POLES,
    CANDIDATE_AREAS,
    WEIGHTED_REGIONS,
    FORBIDDEN_AREAS,
    MANDATORY_AREAS,
)
"""The collections that are read; `SENSORS` and `COVERAGE` are written."""

WEIGHT = "seip_weight"
FORBIDDEN = "seip_forbidden"
MANDATORY = "seip_mandatory"
TITLE = "seip_title"
ORIGIN = "seip_origin"
MAP = "seip_map"
GEO_REFERENCE = "seip_geo_reference"
HEADER_OFFSET = "seip_header_offset"

DEFAULT_WEIGHT = 2.0


def find(scene: bpy.types.Scene, name: str) -> bpy.types.Collection | None:
    """Return the collection of that name anywhere below the scene's root, or None."""
    below = scene.collection.children_recursive
    return next((collection for collection in below if collection.name == name), None)


def find_or_make(scene: bpy.types.Scene, name: str) -> bpy.types.Collection:
    """Return the scene's collection of that name, made under the root where it is missing."""
    collection = find(scene, name)
    if collection is None:
        collection = bpy.data.collections.get(name) or bpy.data.collections.new(name)
        scene.collection.children.link(collection)
    return collection
