"""A rendered view of the scene with the sensors and their coverage."""

from __future__ import annotations

import math
import os
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Matrix, Vector

from ..core.errors import SeipError
from ..core.labelled_view import save_labelled_view
from . import collections as contract

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from ..core.deployment import Deployment
    from ..core.site import Site

    Float = NDArray[np.float64]

WIDTH, HEIGHT = 1440, 810  # pixels
SAMPLES = 16
AZIMUTH, ELEVATION = math.radians(-115.0), math.radians(48.0)  # of the camera as seen from the region: south-west
FIELD_OF_VIEW = math.radians(35.0)  # across the picture
ROOM = 1.04  # around the region
SUN_DIRECTION = (math.radians(38.0), math.radians(-18.0), math.radians(20.0))
AREAS = {
    contract.REGION,
    contract.CANDIDATE_AREAS,
    contract.WEIGHTED_REGIONS,
    contract.FORBIDDEN_AREAS,
    contract.MANDATORY_AREAS,
}
UNSEEN_TYPES = {"LIGHT", "CAMERA", "SPEAKER", "LIGHT_PROBE"}


def save_rendered_view(
    path: str | os.PathLike[str], scene: bpy.types.Scene, site: Site, deployment: Deployment
) -> None:
    """Render the scene from an oblique angle in the south-west and label the sensors, as PNG.

    The picture is taken in a scene of its own that shares the objects and is
    removed afterwards, under its own camera, light and settings: the user's
    scene is not touched and every scene is lit alike. Cycles renders on the
    processor, because the other engines end the process where there is no OpenGL.

    Parameters
    ----------
    path : path-like
        The picture to write.
    scene : bpy.types.Scene
        Holds the result of `write_result`.
    site : Site
    deployment : Deployment
        The chosen sensors and what they see.
    """
    with tempfile.TemporaryDirectory(prefix="seip-") as folder, _stage(scene) as stage:
        raw = Path(folder) / "view.png"
        camera = _add_camera(stage, site)
        _add_light(stage)
        _set_up(stage, raw)
        with _silence():
            bpy.ops.render.render(scene=stage.name, write_still=True)
        anchors = [_on_picture(stage, camera, sensor.xyz) for sensor in deployment.sensors]
        save_labelled_view(path, raw, site, deployment, np.array(anchors).reshape(-1, 2))


@contextmanager
def _stage(scene: bpy.types.Scene) -> Iterator[bpy.types.Scene]:
    """Yield a scene with everything of ``scene`` that renders, and remove it with all that was added to it."""
    shared = _rendered_objects(scene)
    images = set(bpy.data.images)
    stage = bpy.data.scenes.new("SEIP view")
    try:
        for thing in shared:
            stage.collection.objects.link(thing)
        yield stage
    finally:
        own = [thing for thing in stage.collection.objects if thing not in shared]
        world = [stage.world] if stage.world else []
        bpy.data.scenes.remove(stage)
        bpy.data.batch_remove([*own, *(thing.data for thing in own), *world, *(set(bpy.data.images) - images)])


@contextmanager
def _silence() -> Iterator[None]:
    """Keep Blender's lines about each step of a render from standard output, where results are printed."""
    sys.stdout.flush()
    kept = os.dup(1)
    try:
        with Path(os.devnull).open("w", encoding="utf-8") as nowhere:
            os.dup2(nowhere.fileno(), 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


def _rendered_objects(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Return the objects of the scene that renders show, without lights, cameras and areas in plan."""
    found: dict[str, bpy.types.Object] = {}
    layers = [scene.view_layers[0].layer_collection]
    while layers:
        layer = layers.pop()
        if layer.exclude or layer.collection.hide_render or layer.collection.name in AREAS:
            continue
        layers.extend(layer.children)
        found |= {thing.name_full: thing for thing in layer.collection.objects}
    return [
        found[name] for name in sorted(found) if found[name].type not in UNSEEN_TYPES and not found[name].hide_render
    ]


def _add_camera(stage: bpy.types.Scene, site: Site) -> bpy.types.Object:
    """Add a camera that has the whole region in its picture and make it the scene's."""
    data = bpy.data.cameras.new("SEIP view")
    data.angle = FIELD_OF_VIEW
    camera = bpy.data.objects.new("SEIP view", data)
    backwards = Vector(
        (math.cos(ELEVATION) * math.cos(AZIMUTH), math.cos(ELEVATION) * math.sin(AZIMUTH), math.sin(ELEVATION))
    )
    turn = backwards.to_track_quat("Z", "Y").to_matrix()
    place, distance = _viewpoint(np.array(turn), site.targets.xyz)
    camera.matrix_world = Matrix.Translation(place) @ turn.to_4x4()
    data.clip_start, data.clip_end = 0.1, 10.0 * distance + 1000.0
    stage.collection.objects.link(camera)
    stage.camera = camera
    return camera


def _viewpoint(axes: Float, points: Float) -> tuple[Float, float]:
    """Return the nearest place from which a camera with these axes sees all points, and its distance from them.

    A point p in camera axes is in the picture when |x| <= a·d and |y| <= b·d,
    d being its depth; the four bounds give the place directly.

    Parameters
    ----------
    axes : (3, 3) float64
        Right, up and backwards of the camera as columns.
    points : (n, 3) float64
    """
    right, up, back = (points @ axes).T
    slope = np.array((math.tan(FIELD_OF_VIEW / 2.0), math.tan(FIELD_OF_VIEW / 2.0) * HEIGHT / WIDTH)) / ROOM
    needed = []
    centre = []
    for across, a in zip((right, up), slope, strict=True):
        high, low = (across + a * back).max(), (-across + a * back).max()
        needed.append((high + low) / (2.0 * a))
        centre.append((high - low) / 2.0)
    depth = max(needed)
    return axes @ np.array((*centre, depth)), float(depth - back.mean())


def _add_light(stage: bpy.types.Scene) -> None:
    sun = bpy.data.lights.new("SEIP view", "SUN")
    sun.energy = 2.3
    sun.angle = math.radians(3.0)
    lamp = bpy.data.objects.new("SEIP view sun", sun)
    lamp.rotation_euler = SUN_DIRECTION
    stage.collection.objects.link(lamp)
    world = bpy.data.worlds.new("SEIP view")
    if world.node_tree is None:
        world.use_nodes = True
    nodes = world.node_tree.nodes
    nodes.clear()
    sky = nodes.new("ShaderNodeBackground")
    sky.inputs["Color"].default_value = (0.80, 0.88, 1.0, 1.0)
    sky.inputs["Strength"].default_value = 0.42
    world.node_tree.links.new(sky.outputs["Background"], nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
    stage.world = world


def _set_up(stage: bpy.types.Scene, raw: Path) -> None:
    if not hasattr(stage, "cycles"):
        raise SeipError("this Blender has no Cycles, which renders the view; enable it in Preferences, Add-ons")
    render = stage.render
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y, render.resolution_percentage = WIDTH, HEIGHT, 100
    render.filepath = str(raw)
    render.image_settings.file_format = "PNG"
    render.image_settings.color_mode = "RGBA"
    render.film_transparent = True
    stage.view_settings.view_transform = "Standard"
    stage.cycles.device = "CPU"
    stage.cycles.samples = SAMPLES
    stage.cycles.seed = 0
    stage.cycles.use_adaptive_sampling = False
    stage.cycles.use_denoising = False
    stage.cycles.max_bounces = 3


def _on_picture(stage: bpy.types.Scene, camera: bpy.types.Object, point: Float) -> tuple[float, float]:
    """Return where a point is on the picture, in shares of its width and height from the lower left."""
    seen = world_to_camera_view(stage, camera, Vector(point))
    return seen.x, seen.y
