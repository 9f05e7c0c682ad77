"""A rendered view of the scene with the sensors and their coverage."""

from __future__ import annotations

import importlib
import json
import math
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..core.arrays import Boolean, Float
from ..core.choosing.placement.deployment import Deployment
from ..core.errors import SeipError
from ..core.output.pictures.labelled_view import Sight, save_labelled_view
from ..core.output.pictures.viewpoint import Viewpoint, frame
from ..core.site.site import Site
from . import contract
from .daylight import add_daylight
from .interrupts import held_interrupts
from .write import shown_legend

WIDTH, HEIGHT = 1440, 810  # pixels
SAMPLES, DENOISED_SAMPLES = 12, 2  # without and with a denoiser, for as little noise or less
AZIMUTH, ELEVATION = math.radians(-115.0), math.radians(52.0)  # of the camera, seen from the region
FIELD_OF_VIEW = math.radians(35.0)  # across the picture
ROOM = 1.04  # around the region
SENSOR_ROOM = 0.5  # metres round a sensor that its own body and bracket take up
UNSEEN_TYPES = {"LIGHT", "CAMERA", "SPEAKER", "LIGHT_PROBE"}


@dataclass(frozen=True, eq=False)
class Shot:
    """Settings of a picture, without the scene.

    Parameters
    ----------
    reach : float, metres
        From the camera, as far as anything is shown.
    sensors : (k, 3) float64, metres
        Optical centres.
    """

    viewpoint: Viewpoint
    reach: float
    sensors: Float

    def as_json(self) -> str:
        """Return it as a text for `from_json`."""
        view = self.viewpoint
        arrays = (view.place, view.axes, view.slopes, self.sensors)
        return json.dumps([self.reach, *(array.tolist() for array in arrays)])

    @classmethod
    def from_json(cls, text: str) -> Shot:
        """Return what `as_json` wrote down."""
        reach, place, axes, slopes, sensors = json.loads(text)
        viewpoint = Viewpoint(np.array(place), np.array(axes), np.array(slopes))
        return cls(viewpoint, reach, np.array(sensors, dtype=np.float64).reshape(-1, 3))


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
    deployment : Deployment
        The chosen sensors and what they see.
    """
    shot = shot_of(site, deployment)
    with tempfile.TemporaryDirectory(prefix="seip-") as folder:
        raw = Path(folder) / "view.png"
        with _silence():
            hidden = take(shot, scene, raw)
        save_labelled_view(path, raw, site, deployment, shown_legend(scene), sight_of(shot, hidden, site))


def take(shot: Shot, scene: bpy.types.Scene, raw: Path) -> Boolean:
    """Render a scene's picture without labels, and return which sensors something stands in front of, (k,) bool."""
    with _stage(scene) as stage:
        _add_camera(stage, shot)
        add_daylight(stage, stage.collection)
        _set_up(stage, raw)
        with held_interrupts():
            bpy.ops.render.render(scene=stage.name, write_still=True)
        return _hidden(stage, shot)


@contextmanager
def _stage(scene: bpy.types.Scene) -> Iterator[bpy.types.Scene]:
    """Yield a scene with everything of ``scene`` that renders, and remove it with all that was added to it."""
    shared = _rendered_objects(scene)
    images = set(bpy.data.images)
    stage = bpy.data.scenes.new("SEIP view")
    try:
        for obj in shared:
            stage.collection.objects.link(obj)
        yield stage
    finally:
        own = [obj for obj in stage.collection.objects if obj not in shared]
        world = [stage.world] if stage.world else []
        bpy.data.scenes.remove(stage)
        bpy.data.batch_remove([*own, *(obj.data for obj in own), *world, *(set(bpy.data.images) - images)])


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
        found |= {obj.name_full: obj for obj in layer.collection.objects}
    return [
        found[name] for name in sorted(found) if found[name].type not in UNSEEN_TYPES and not found[name].hide_render
    ]


def shot_of(site: Site, deployment: Deployment) -> Shot:
    """Return a shot that has the whole region in its picture."""
    slope = math.tan(FIELD_OF_VIEW / 2.0)
    slopes = np.array((slope, slope * HEIGHT / WIDTH))
    tight = frame(site.targets.xyz, AZIMUTH, ELEVATION, slopes / ROOM)
    reach = 2.0 * float(np.linalg.norm(site.targets.xyz - tight.place, axis=1).max())
    sensors = np.array([sensor.xyz for sensor in deployment.sensors]).reshape(-1, 3)
    return Shot(Viewpoint(tight.place, tight.axes, slopes), reach, sensors)


def _add_camera(stage: bpy.types.Scene, shot: Shot) -> None:
    data = bpy.data.cameras.new("SEIP view")
    data.angle = FIELD_OF_VIEW
    camera = bpy.data.objects.new("SEIP view", data)
    camera.matrix_world = Matrix.Translation(shot.viewpoint.place) @ Matrix(shot.viewpoint.axes.tolist()).to_4x4()
    data.clip_end = shot.reach
    stage.collection.objects.link(camera)
    stage.camera = camera


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
    stage.cycles.samples = sample_count()
    stage.cycles.seed = 0
    stage.cycles.use_adaptive_sampling = False
    stage.cycles.use_denoising = has_denoiser()
    # at the highest quality, denoising takes five times as long as two samples: the picture hardly differs
    stage.cycles.denoising_quality = stage.cycles.denoising_prefilter = "FAST"
    stage.cycles.max_bounces = 2


def has_denoiser() -> bool:
    """Return whether this Blender is built with Open Image Denoise; those of Debian are not."""
    try:
        cycles = importlib.import_module("_cycles")
    except ImportError:
        return False
    return bool(getattr(cycles, "with_openimagedenoise", False))


def sample_count() -> int:
    """Return the number of samples of each pixel."""
    return min(SAMPLES, DENOISED_SAMPLES) if has_denoiser() else SAMPLES


def _hidden(stage: bpy.types.Scene, shot: Shot) -> Boolean:
    layer = stage.view_layers[0]
    layer.update()
    start = Vector(shot.viewpoint.place)
    ways = [Vector(sensor) - start for sensor in shot.sensors]
    hits = [
        stage.ray_cast(layer.depsgraph, start, way.normalized(), distance=way.length - SENSOR_ROOM)[0] for way in ways
    ]
    return np.array(hits, dtype=bool)


def sight_of(shot: Shot, hidden: Boolean, site: Site) -> Sight:
    """Return where sensors and targets are on the picture, and which sensors something stands in front of."""
    return Sight(shot.viewpoint.project(shot.sensors), hidden, shot.viewpoint.project(site.targets.xyz))
