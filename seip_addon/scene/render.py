"""A rendered view of the scene with the sensors and their coverage."""

from __future__ import annotations

import importlib
import json
import math
import sys
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..core.base.arrays import Boolean, Float
from ..core.base.errors import SeipError
from ..core.base.progress import Progress
from ..core.choosing.placement.deployment import Deployment
from ..core.output.pictures.viewpoint import Sight, Viewpoint, frame
from ..core.programs.child_process import run_logged
from ..core.site.site import Site
from . import contract
from .daylight import add_daylight
from .interrupts import held_signals

WIDTH, HEIGHT = 1440, 810  # pixels
SAMPLES, DENOISED_SAMPLES = 12, 1  # without and with a denoiser
AZIMUTHS, ELEVATION = np.radians(-115.0 + 45.0 * np.arange(8)), math.radians(60.0)
"""Directions of the camera, seen from the region."""
MOST_POINTS = 400  # places on the road at which the view is checked for obstacles
EQUAL_VIEW = 0.05  # share of the road by which views that hide less than others are as good as the best
FIELD_OF_VIEW = math.radians(35.0)  # across the picture
ROOM = 1.07  # around the region and the sensors
SENSOR_ROOM = 0.5  # metres round a sensor that its own body and bracket take up
UNSEEN_TYPES = {"LIGHT", "CAMERA", "SPEAKER", "LIGHT_PROBE"}


@dataclass(frozen=True, eq=False)
class Shot:
    """Settings of a picture, without the scene.

    Parameters
    ----------
    viewpoints : tuple of Viewpoint
        In order of preference; the first that hides little enough of the road is taken, see `EQUAL_VIEW`.
    reach : float, metres
        Distance from the camera up to which anything is shown.
    sensors : (k, 3) float64, metres
        Optical centres.
    road : (n, 3) float64, metres
        Points of the road that should be visible.
    """

    viewpoints: tuple[Viewpoint, ...]
    reach: float
    sensors: Float
    road: Float

    def as_json(self) -> list[Any]:
        """Return it as a JSON value for `from_json`."""
        views = [[array.tolist() for array in (view.place, view.axes, view.slopes)] for view in self.viewpoints]
        return [views, self.reach, self.sensors.tolist(), self.road.tolist()]

    @classmethod
    def from_json(cls, value: list[Any]) -> Shot:
        """Return the settings that `as_json` wrote."""
        views, reach, sensors, road = value
        viewpoints = tuple(Viewpoint(*(np.array(array) for array in view)) for view in views)
        sensors, road = (np.array(xyz, dtype=np.float64).reshape(-1, 3) for xyz in (sensors, road))
        return cls(viewpoints, reach, sensors, road)


def shot_of(site: Site, deployment: Deployment) -> Shot:
    """Return a shot with the whole region and all sensors in its picture."""
    slope = math.tan(FIELD_OF_VIEW / 2.0)
    slopes = np.array((slope, slope * HEIGHT / WIDTH))
    sensors = np.array([sensor.xyz for sensor in deployment.sensors]).reshape(-1, 3)
    points = np.vstack((site.targets.xyz, sensors))
    # From the nearest camera position, the region is largest in the picture.
    tight = sorted(
        (frame(points, azimuth, ELEVATION, slopes / ROOM) for azimuth in AZIMUTHS),
        key=lambda view: round(float(np.linalg.norm(view.place - points.mean(axis=0))), 3),
    )
    reach = 2.0 * max(float(np.linalg.norm(points - view.place, axis=1).max()) for view in tight)
    around = tuple(Viewpoint(view.place, view.axes, slopes) for view in tight)
    return Shot(around, reach, sensors, site.targets.xyz[:: math.ceil(len(site.targets) / MOST_POINTS)])


def render_elsewhere(
    raw: Path, blend: Path, scene: str, site: Site, deployment: Deployment
) -> Generator[Progress, None, Sight]:
    """Render a scene without labels, from the side that hides least of the road, in a Blender of its own.

    The program itself remains responsive, and Ctrl-C ends it at once; Blender's own rendering allows neither.

    Parameters
    ----------
    raw : path
        Picture to write, in a folder for temporary files.
    blend : path
        File with the scene.
    scene : str
        Name of the scene.

    Yields
    ------
    Progress
        Ten times a second; closing the generator ends the other Blender.

    Raises
    ------
    SeipError
        The other Blender failed.
    """
    shot = shot_of(site, deployment)
    job, log, answer = (raw.with_name(name) for name in ("job.json", "log", "taken.json"))
    request = {"path": sys.path, "blend": str(blend), "scene": scene, "raw": str(raw), "answer": str(answer)}
    job.write_text(json.dumps(request | {"shot": shot.as_json()}))
    temporary = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(raw.parent))  # which Blender leaves when it is ended
    yield from run_logged(_command(job), log, lambda _: Progress(0, 0, "rendering"), environment=temporary)
    try:
        number, hidden = json.loads(answer.read_text())
    except OSError as error:
        last = log.read_text(errors="replace").strip().splitlines()[-1:]
        raise SeipError(f"the view could not be rendered ({' '.join(last)}): export without it") from error
    view = shot.viewpoints[number]
    return Sight(view.project(shot.sensors), np.array(hidden, dtype=bool), view.project(site.targets.xyz))


def _command(job: Path) -> list[str]:
    """Return the command that runs a job of `render_job` in a Blender without a window, or on the bpy module."""
    script = str(Path(__file__).with_name("render_job.py"))
    if bpy.app.binary_path:
        return [bpy.app.binary_path, "-b", "--factory-startup", "-P", script, "--", str(job)]
    return [sys.executable, script, "--", str(job)]


def take(shot: Shot, scene: bpy.types.Scene, raw: Path) -> tuple[int, Boolean]:
    """Render a picture of a scene without labels.

    The picture is taken in a scene that shares the objects and is removed afterwards, under its own camera, light and
    settings: the user's scene is not touched and every scene is lit alike. Cycles renders on the processor, because the
    other engines end the process where there is no OpenGL.

    Parameters
    ----------
    scene : bpy.types.Scene
        Holds the result of `write_result`.

    Returns
    -------
    int, (k,) bool
        Number of the viewpoint, and the sensors that something stands in front of.
    """
    with _stage(scene) as stage:
        add_daylight(stage, stage.collection)
        camera = _add_camera(stage)
        _set_up(stage)
        covered = np.array([_hidden(stage, shot.road, viewpoint).mean() for viewpoint in shot.viewpoints])
        number = int(np.argmax(covered <= covered.min() + EQUAL_VIEW))
        hidden = _hidden(stage, shot.sensors, shot.viewpoints[number])
        _aim(camera, shot.viewpoints[number], shot.reach)
        stage.render.resolution_x, stage.render.resolution_y = WIDTH, HEIGHT
        stage.render.filepath = str(raw)
        with held_signals():
            bpy.ops.render.render(scene=stage.name, write_still=True)
    return number, hidden


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


def _rendered_objects(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Return the objects of the scene that renders show, without lights, cameras and areas in plan."""
    found: dict[str, bpy.types.Object] = {}
    layers = [scene.view_layers[0].layer_collection]
    while layers:
        layer = layers.pop()
        if layer.exclude or layer.collection.hide_render or contract.base_name(layer.collection) in contract.AREAS:
            continue
        layers.extend(layer.children)
        found |= {obj.name_full: obj for obj in layer.collection.objects}
    return [
        found[name] for name in sorted(found) if found[name].type not in UNSEEN_TYPES and not found[name].hide_render
    ]


def _add_camera(stage: bpy.types.Scene) -> bpy.types.Object:
    camera = bpy.data.objects.new("SEIP view", bpy.data.cameras.new("SEIP view"))
    stage.collection.objects.link(camera)
    stage.camera = camera
    return camera


def _aim(camera: bpy.types.Object, viewpoint: Viewpoint, reach: float) -> None:
    camera.matrix_world = Matrix.Translation(viewpoint.place) @ Matrix(viewpoint.axes.tolist()).to_4x4()
    camera.data.angle = 2.0 * math.atan(float(viewpoint.slopes[0]))
    camera.data.clip_end = reach


def _set_up(stage: bpy.types.Scene) -> None:
    if not hasattr(stage, "cycles"):
        raise SeipError("this Blender has no Cycles, which renders the view; enable it in Preferences, Add-ons")
    render = stage.render
    render.engine = "CYCLES"
    render.resolution_percentage = 100
    render.image_settings.file_format = "PNG"
    render.image_settings.color_mode = "RGBA"
    render.film_transparent = True
    stage.view_settings.view_transform = "Standard"
    stage.cycles.device = "CPU"
    stage.cycles.samples = min(SAMPLES, DENOISED_SAMPLES) if has_denoiser() else SAMPLES
    stage.cycles.seed = 0
    stage.cycles.use_adaptive_sampling = False
    stage.cycles.use_denoising = has_denoiser()
    # at the highest quality, denoising takes ten times as long as a sample: the picture hardly differs
    stage.cycles.denoising_quality = stage.cycles.denoising_prefilter = "FAST"
    stage.cycles.max_bounces = 2


def has_denoiser() -> bool:
    """Return whether this Blender is built with Open Image Denoise; those of Debian are not."""
    try:
        cycles = importlib.import_module("_cycles")
    except ImportError:
        return False
    return bool(getattr(cycles, "with_openimagedenoise", False))


def _hidden(stage: bpy.types.Scene, points: Float, viewpoint: Viewpoint) -> Boolean:
    """Return which points (n, 3) something stands in front of, seen from a viewpoint, (n,) bool."""
    layer = stage.view_layers[0]
    layer.update()
    start = Vector(viewpoint.place)
    ways = [Vector(point) - start for point in points]
    hits = [
        stage.ray_cast(layer.depsgraph, start, way.normalized(), distance=way.length - SENSOR_ROOM)[0] for way in ways
    ]
    return np.array(hits, dtype=bool)
