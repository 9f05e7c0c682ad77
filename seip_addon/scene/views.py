"""3D views: what they show of a site, and from where."""

from __future__ import annotations

import math

import bpy
import numpy as np
from mathutils import Vector

from . import contract

CLIP_START, CLIP_END = 0.5, 5000.0
"""Metres before the eye between which a 3D view shows objects: a site, without flicker of what lies close together."""
VIEW_SENSOR = 72.0
"""Millimetres of the longer side of a 3D view's sensor; a camera's is 36 unless it is set."""
MARGIN = 1.15
"""Factor on the distance from which a site fills a view: the sidebar takes a part of it."""


def set_up_view(view: bpy.types.SpaceView3D) -> None:
    """Have a view show a whole site in the colours of its materials."""
    view.clip_start, view.clip_end = CLIP_START, CLIP_END
    shading = view.shading
    shading.type, shading.light, shading.color_type = "SOLID", "STUDIO", "MATERIAL"
    shading.show_cavity, shading.cavity_type = True, "SCREEN"
    shading.show_shadows, shading.shadow_intensity = True, 0.25


def frame_site(area: bpy.types.Area, scene: bpy.types.Scene) -> None:
    """Look at a site as the scene's camera does, free to be turned; without camera or region from where the view is.

    Parameters
    ----------
    area : bpy.types.Area
        With a 3D view.
    """
    view, camera = area.spaces.active, scene.camera
    set_up_view(view)
    if camera is None or camera.type != "CAMERA" or not contract.has_members(scene, contract.REGION):
        return
    region = next(region for region in area.regions if region.type == "WINDOW")
    scene.view_layers[0].update()
    middle = _middle_of_region(scene)
    ahead = camera.matrix_world.to_quaternion() @ Vector((0.0, 0.0, -1.0))
    camera_width = math.tan(camera.data.angle_x / 2)
    view_width = VIEW_SENSOR / 2 / view.lens
    frame = scene.render.resolution_x / scene.render.resolution_y
    wide = max(region.width, 1) / max(region.height, 1)
    tall = max(1.0, wide / frame)
    narrow = max(1.0, 1.0 / wide)
    look = view.region_3d
    look.view_perspective = "PERSP"
    look.view_rotation = camera.matrix_world.to_quaternion()
    look.view_location = middle
    distance = (middle - camera.matrix_world.translation).dot(ahead)
    look.view_distance = MARGIN * distance * camera_width / view_width * tall * narrow


def _middle_of_region(scene: bpy.types.Scene) -> Vector:
    """Return the middle of the box around the region, at the height 0."""
    region = contract.members(scene)[contract.REGION]
    corners = np.array([(obj.matrix_world @ Vector(corner))[:2] for obj in region for corner in obj.bound_box])
    return Vector((*(corners.min(axis=0) + corners.max(axis=0)) / 2, 0.0))
