"""The objects with which Blender starts: no part of a site."""

from __future__ import annotations

import bpy
from mathutils import Vector

STARTUP = {
    "Cube": ("MESH", (0.0, 0.0, 0.0)),
    "Light": ("LIGHT", (4.07625, 1.00545, 5.90386)),
    "Camera": ("CAMERA", (7.35889, -6.92579, 4.95831)),
}
"""Type and place, metres, of each."""
CORNERS, CORNER_DISTANCE = 8, 3**0.5


def remove_startup_objects(scene: bpy.types.Scene) -> bool:
    """Remove Blender's cube, light and camera where a scene holds them as they came, and nothing else.

    Returns
    -------
    bool
        Whether they were there.
    """
    if {obj.name for obj in scene.objects} != STARTUP.keys() or not all(map(_is_untouched, scene.objects)):
        return False
    bpy.data.batch_remove([*(obj.data for obj in scene.objects), *scene.objects])
    return True


def _is_untouched(obj: bpy.types.Object) -> bool:
    kind, place = STARTUP[obj.name]
    if obj.type != kind or (obj.location - Vector(place)).length > 1e-3 or obj.modifiers or obj.animation_data:
        return False
    if kind != "MESH":
        return True
    corners = obj.data.vertices
    return len(corners) == CORNERS and all(abs(corner.co.length - CORNER_DISTANCE) < 1e-4 for corner in corners)
