"""A rendered view of the scene with the sensors and their coverage."""

from __future__ import annotations

import math
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..core.deployment import Deployment
from ..core.errors import SeipError
from ..core.pictures.labelled_view import Sight, save_labelled_view
from ..core.pictures.viewpoint import Viewpoint, frame
from ..core.site import Site
from . import contract
from .daylight import add_daylight
from .interrupts import held_interrupts

WIDTH, HEIGHT = 1440, 810  # pixels
SAMPLES = 12
AZIMUTH, ELEVATION = math.radians(-115.0), math.radians(52.0)  # of the camera, seen from the region
FIELD_OF_VIEW = math.radians(35.0)  # across the picture
ROOM = 1.04  # around the region
SENSOR_ROOM = 0.5  # metres round a sensor that its own body and bracket take up
UNSEEN_TYPES = {"LIGHT", "CAMERA", "SPEAKER", "LIGHT_PROBE"}


def save_rendered_view(
    path: str | os.PathLike[str], scene: bpy.types.Scene, site: Site, deployment: Deployment
) -> None:
    """Render the scene from an oblique angle in the south and label the sensors, as PNG.

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
        viewpoint = _add_camera(stage, site)
        add_daylight(stage, stage.collection)
        _set_up(stage, raw)
        with _silence(), held_interrupts():
            bpy.ops.render.render(scene=stage.name, write_still=True)
        sight = _sight(stage, viewpoint, site, deployment)
        save_labelled_view(path, raw, site, deployment, sight)


@contextmanager
def _stage(scene: bpy.types.Scene) -> Iterator[bpy.types.Scene]:
    """Yield a scene with everything of ``scene`` that renders, and remove it with all that was added to it."""
    shared = _rendered_objects(scene)
    images = set(bpy.data.images)
    stage = bpy.data.scenes.new("SEIP view")
    try:
        for thing in shared:
            stage.collection.objects.link(thing)
        stage.frame_set(scene.frame_current, subframe=scene.frame_subframe)  # where the traffic stands now
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
        if layer.exclude or layer.collection.hide_render or contract.kind(layer.collection) in contract.AREAS:
            continue
        layers.extend(layer.children)
        found |= {thing.name_full: thing for thing in layer.collection.objects}
    return [
        found[name] for name in sorted(found) if found[name].type not in UNSEEN_TYPES and not found[name].hide_render
    ]


def _add_camera(stage: bpy.types.Scene, site: Site) -> Viewpoint:
    """Add a camera that has the whole region in its picture, and return where it stands."""
    data = bpy.data.cameras.new("SEIP view")
    data.angle = FIELD_OF_VIEW
    slope = math.tan(FIELD_OF_VIEW / 2.0)
    slopes = np.array((slope, slope * HEIGHT / WIDTH))
    tight = frame(site.targets.xyz, AZIMUTH, ELEVATION, slopes / ROOM)
    camera = bpy.data.objects.new("SEIP view", data)
    camera.matrix_world = Matrix.Translation(tight.place) @ Matrix(tight.axes.tolist()).to_4x4()
    data.clip_end = 2.0 * float(np.linalg.norm(site.targets.xyz - tight.place, axis=1).max())
    stage.collection.objects.link(camera)
    stage.camera = camera
    return Viewpoint(tight.place, tight.axes, slopes)


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
    stage.cycles.max_bounces = 2


def _sight(stage: bpy.types.Scene, viewpoint: Viewpoint, site: Site, deployment: Deployment) -> Sight:
    """Return where sensors and targets are on the picture, and which sensors something stands in front of."""
    sensors = np.array([sensor.xyz for sensor in deployment.sensors]).reshape(-1, 3)
    layer = stage.view_layers[0]
    layer.update()
    start = Vector(viewpoint.place)
    ways = [Vector(sensor) - start for sensor in sensors]
    hidden = [
        stage.ray_cast(layer.depsgraph, start, way.normalized(), distance=way.length - SENSOR_ROOM)[0] for way in ways
    ]
    return Sight(viewpoint.project(sensors), np.array(hidden, dtype=bool), viewpoint.project(site.targets.xyz))
