"""Build a Blender scene from a modelled site."""

from __future__ import annotations

import math
from collections.abc import Generator

import bpy
import numpy as np
import shapely
from mathutils import Vector

from ..core.base.progress import Progress
from ..core.site.roles import AREA_OVERLAYS, Role
from ..core.storage.files import digest
from ..core.world.streetscape.model import SiteModel
from ..core.world.streetscape.parts import Part
from . import contract
from .daylight import add_daylight
from .meshes import mesh_of
from .named_places import places_text
from .pieces import attach_piece
from .views import CLIP_END, CLIP_START

DRESSING = "Dressing"
VIEW = "View"

COLLECTIONS = {
    Role.REGION: contract.REGION,
    Role.ROADS: contract.ROADS,
    Role.GROUND: contract.GROUND,
    Role.OCCLUDERS: contract.OCCLUDERS,
    Role.POLES: contract.POLES,
    Role.CANDIDATE_AREAS: contract.CANDIDATE_AREAS,
    Role.WEIGHTED_REGIONS: contract.WEIGHTED_REGIONS,
    Role.FORBIDDEN_AREAS: contract.FORBIDDEN_AREAS,
    Role.MANDATORY_AREAS: contract.MANDATORY_AREAS,
    Role.DRESSING: DRESSING,
}
STEP = 50
CAMERA_AZIMUTH = math.radians(-125.0)
CAMERA_ELEVATION = math.radians(48.0)
LENS = 40.0
FRAME = 3.0
"""Margin (metres) around the region in the camera's view."""
STARTUP = {
    "Cube": ("MESH", (0.0, 0.0, 0.0)),
    "Light": ("LIGHT", (4.07625, 1.00545, 5.90386)),
    "Camera": ("CAMERA", (7.35889, -6.92579, 4.95831)),
}
"""Objects with which Blender starts: type and place, metres, of each."""
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


def remove_site(scene: bpy.types.Scene) -> None:
    """Remove the objects that `build_scene` made from a scene; all others stay."""
    built = [obj for obj in scene.objects if contract.BUILT in obj]
    data = {obj.data for obj in built if obj.data is not None}
    bpy.data.batch_remove(built)
    bpy.data.batch_remove([one for one in data if not one.users])


def build_scene(scene: bpy.types.Scene, model: SiteModel, map_name: str) -> Generator[Progress, None, None]:
    """Fill a scene with a site, after the scene contract of docs/scene-contract.md.

    Parameters
    ----------
    scene : bpy.types.Scene
        Receives the site, its camera and light, and is named after it.
    map_name : str
        File name of the map, kept in the scene.

    Yields
    ------
    Progress
        Parts made, of all.
    """
    scene.name = model.name
    _describe(scene, model, map_name)
    for name in COLLECTIONS.values():
        contract.find_or_make(scene, name)
    meshes: dict[str, bpy.types.Mesh] = {}
    made: dict[str, bpy.types.Object] = {}
    for number, part in enumerate(model.parts):
        if number % STEP == 0:
            yield Progress(number, len(model.parts), "objects")
        made[part.name] = _add(scene, part, meshes)
        if part.of:
            _attach(made[part.name], made[part.of])
    yield Progress(len(model.parts), len(model.parts), "objects")
    add_daylight(scene, contract.find_or_make(scene, VIEW))[contract.BUILT] = True
    _frame(scene, model)


def _describe(scene: bpy.types.Scene, model: SiteModel, map_name: str) -> None:
    """Write what the scene contract asks for, and metres, into the scene."""
    scene[contract.TITLE] = model.name
    scene[contract.ORIGIN] = model.origin.tolist()
    scene[contract.MAP] = map_name
    scene[contract.GEO_REFERENCE] = model.geo_reference or ""
    scene[contract.HEADER_OFFSET] = model.header_offset.tolist()
    scene[contract.PLACES] = places_text(model.places)
    scene[contract.ATTRIBUTION] = "\n".join(model.attribution)
    scene[contract.ASSUMPTIONS] = "\n".join(model.notes)
    scene.unit_settings.system = "METRIC"
    scene.unit_settings.scale_length = 1.0


def _attach(piece: bpy.types.Object, whole: bpy.types.Object) -> None:
    """Have a piece go where the whole goes, from where it stands."""
    attach_piece(piece, whole)
    piece.matrix_parent_inverse = whole.matrix_basis.inverted()


def _add(scene: bpy.types.Scene, part: Part, meshes: dict[str, bpy.types.Mesh]) -> bpy.types.Object:
    """Add a part as an object; parts of one shape share a mesh."""
    solid = part.solid
    shape = digest(solid.vertices, repr(solid.faces), repr(solid.materials))
    if shape not in meshes:
        meshes[shape] = mesh_of(part.name, solid)
    obj = bpy.data.objects.new(part.name, meshes[shape])
    obj[contract.BUILT] = True
    obj.location = part.foot
    obj.rotation_euler = (0.0, 0.0, part.yaw)
    if part.weight is not None:
        obj[contract.WEIGHT] = part.weight
    if part.source:
        obj[contract.SOURCE] = part.source
    if part.keep_off is not None:
        obj[contract.KEEP_OFF] = part.keep_off
    if part.height_assumed:
        obj[contract.HEIGHT_ASSUMED] = True
    if part.width_assumed:
        obj[contract.WIDTH_ASSUMED] = True
    obj.hide_render = AREA_OVERLAYS.keys() >= set(part.roles)  # the viewport shows what only means an area
    for role in part.roles:
        contract.find_or_make(scene, COLLECTIONS[role]).objects.link(obj)
    return obj


def _frame(scene: bpy.types.Scene, model: SiteModel) -> None:
    """Add a camera that sees all of the region at a slant, and settings under which it looks good at once."""
    scene.render.resolution_x, scene.render.resolution_y = 1600, 900
    camera = bpy.data.cameras.new("Overview")
    camera.lens = LENS
    camera.clip_start, camera.clip_end = CLIP_START, CLIP_END
    obj = bpy.data.objects.new("Overview", camera)
    obj[contract.BUILT] = True
    obj.rotation_euler = (math.pi / 2 - CAMERA_ELEVATION, 0.0, CAMERA_AZIMUTH + math.pi / 2)
    contract.find_or_make(scene, VIEW).objects.link(obj)
    scene.camera = obj
    layer = scene.view_layers[0]
    layer.update()
    outline = shapely.get_coordinates(model.region.convex_hull.buffer(FRAME))
    corners = np.column_stack([outline, np.zeros(len(outline))])
    obj.location, _ = obj.camera_fit_coords(layer.depsgraph, corners.ravel().tolist())
    scene.view_settings.view_transform = "Standard"
    shading = scene.display.shading
    shading.light, shading.color_type = "STUDIO", "MATERIAL"
    shading.show_shadows = shading.show_cavity = True
    shading.shadow_intensity = 0.35
    scene.display.light_direction = (-0.45, 0.80, 0.40)  # here y is up
