"""From a modelled site to a Blender scene that a person is glad to open."""

from __future__ import annotations

import math
from collections.abc import Generator
from pathlib import Path

import bpy
import numpy as np
import shapely

from ..core.errors import SeipError
from ..core.progress import Progress
from ..core.storage import digest, whole_file
from ..core.streetscape.model import SiteModel
from ..core.streetscape.parts import Part, Role
from ..core.streetscape.street_furniture import Solid
from . import contract
from .materials import material

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
VEILS = {Role.REGION, Role.WEIGHTED_REGIONS, Role.FORBIDDEN_AREAS, Role.MANDATORY_AREAS, Role.CANDIDATE_AREAS}
"""Parts that have no other roles mean an area: the viewport shows them, a render does not."""

STEP = 50
CAMERA_AZIMUTH = math.radians(-125.0)
CAMERA_ELEVATION = math.radians(48.0)
LENS = 40.0
FRAME = 3.0
"""Margin (metres) around the region in the camera's view."""
SUN_ELEVATION, SUN_AZIMUTH = math.radians(48.0), math.radians(-60.0)
SKY = (0.62, 0.70, 0.80, 1.0)


def build_scene(model: SiteModel, map_name: str) -> Generator[Progress, None, bpy.types.Scene]:
    """Make a new file with the scene of a site, after the scene contract of docs/architecture.md.

    Parameters
    ----------
    model : SiteModel
    map_name : str
        File name of the map, kept in the scene.

    Yields
    ------
    Progress
        Parts made, of all.

    Returns
    -------
    bpy.types.Scene
        The only scene; whatever was open before is gone.
    """
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.name = model.name
    _describe(scene, model, map_name)
    for name in COLLECTIONS.values():
        contract.find_or_make(scene, name)
    meshes: dict[str, bpy.types.Mesh] = {}
    for number, part in enumerate(model.parts):
        if number % STEP == 0:
            yield Progress(number, len(model.parts), "objects")
        _add(scene, part, meshes)
    yield Progress(len(model.parts), len(model.parts), "objects")
    _light(scene)
    _frame(scene, model)
    _set_up_views()
    return scene


def save_blend(path: Path) -> None:
    """Write the open scene to a .blend, compressed.

    Raises
    ------
    SeipError
        The name does not end in .blend, or the file cannot be written.
    """
    if path.suffix != ".blend":
        raise SeipError(f"{path} is no name for a Blender file; let it end in .blend")
    with whole_file(path) as temporary:
        temporary.unlink()  # Blender would keep a backup of a file that is there
        bpy.ops.wm.save_as_mainfile(filepath=str(temporary.resolve()), copy=True, compress=True, check_existing=False)


def _describe(scene: bpy.types.Scene, model: SiteModel, map_name: str) -> None:
    """Write what the scene contract asks for, and metres, into the scene."""
    scene[contract.TITLE] = model.name
    scene[contract.ORIGIN] = model.origin.tolist()
    scene[contract.MAP] = map_name
    scene[contract.GEO_REFERENCE] = model.geo_reference or ""
    scene[contract.HEADER_OFFSET] = model.header_offset.tolist()
    scene.unit_settings.system = "METRIC"
    scene.unit_settings.scale_length = 1.0


def _add(scene: bpy.types.Scene, part: Part, meshes: dict[str, bpy.types.Mesh]) -> None:
    """Add a part as an object; parts of one shape share a mesh."""
    solid = part.solid
    shape = digest(solid.vertices, repr(solid.faces), repr(solid.materials))
    if shape not in meshes:
        meshes[shape] = _mesh(part.name, solid)
    thing = bpy.data.objects.new(part.name, meshes[shape])
    thing.location = part.foot
    thing.rotation_euler = (0.0, 0.0, part.yaw)
    if part.weight is not None:
        thing[contract.WEIGHT] = part.weight
    thing.hide_render = VEILS.issuperset(part.roles)
    for role in part.roles:
        contract.find_or_make(scene, COLLECTIONS[role]).objects.link(thing)


def _mesh(name: str, solid: Solid) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(solid.vertices.tolist(), [], solid.faces)
    names = sorted(set(solid.materials))
    for each in names:
        mesh.materials.append(material(each))
    slots = np.array([names.index(each) for each in solid.materials], dtype=np.int32)
    mesh.polygons.foreach_set("material_index", slots)
    mesh.update()
    return mesh


def _light(scene: bpy.types.Scene) -> None:
    """Add a sun and a pale sky."""
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy = 3.2
    sun.angle = math.radians(2.0)
    thing = bpy.data.objects.new("Sun", sun)
    thing.rotation_euler = (math.pi / 2 - SUN_ELEVATION, 0.0, SUN_AZIMUTH)
    thing.location = (0.0, 0.0, 60.0)
    contract.find_or_make(scene, VIEW).objects.link(thing)
    world = bpy.data.worlds.new("Sky")
    if world.node_tree is None:  # from Blender 5.0 on nodes are always there
        world.use_nodes = True
    world.color = SKY[:3]
    sky = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    sky.inputs["Color"].default_value = SKY
    sky.inputs["Strength"].default_value = 0.7
    scene.world = world


def _frame(scene: bpy.types.Scene, model: SiteModel) -> None:
    """Add a camera that sees all of the region at a slant, and settings under which it looks good at once."""
    scene.render.resolution_x, scene.render.resolution_y = 1600, 900
    camera = bpy.data.cameras.new("Overview")
    camera.lens = LENS
    camera.clip_end = 5000.0
    thing = bpy.data.objects.new("Overview", camera)
    thing.rotation_euler = (math.pi / 2 - CAMERA_ELEVATION, 0.0, CAMERA_AZIMUTH + math.pi / 2)
    contract.find_or_make(scene, VIEW).objects.link(thing)
    scene.camera = thing
    bpy.context.view_layer.update()
    outline = shapely.get_coordinates(model.region.convex_hull.buffer(FRAME))
    corners = np.column_stack([outline, np.zeros(len(outline))])
    thing.location, _ = thing.camera_fit_coords(bpy.context.evaluated_depsgraph_get(), corners.ravel().tolist())
    scene.view_settings.view_transform = "Standard"
    shading = scene.display.shading
    shading.light, shading.color_type = "STUDIO", "MATERIAL"
    shading.show_shadows = shading.show_cavity = True
    shading.shadow_intensity = 0.35
    scene.display.light_direction = (-0.45, 0.80, 0.40)  # here y is up


def _set_up_views() -> None:
    """Let every 3D view look through the camera, in the materials' colours and far enough."""
    views = (area.spaces.active for screen in bpy.data.screens for area in screen.areas if area.type == "VIEW_3D")
    for view in views:
        view.clip_end = 5000.0
        view.shading.color_type = "MATERIAL"
        view.region_3d.view_perspective = "CAMERA"
