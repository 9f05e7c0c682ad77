"""A rendered view of the scene with the sensors and their coverage."""

from __future__ import annotations

import importlib
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector
from PIL import Image

from ..core.base.arrays import Boolean, Float
from ..core.base.errors import SeipError
from ..core.choosing.placement.deployment import Deployment
from ..core.output.pictures.viewpoint import MOST, TILE, Sight, Viewpoint, frame, viewpoints
from ..core.site.site import Site
from . import contract
from .daylight import add_daylight
from .interrupts import held_signals

WIDTH, HEIGHT = 1440, 810  # pixels
SAMPLES, DENOISED_SAMPLES = 12, 1  # without and with a denoiser
"""Against 150 samples, close-ups of the shipped junction differ by 3.8 and 4.4 of 255 (root mean square)."""
AZIMUTHS, ELEVATION = np.radians(-115.0 + 45.0 * np.arange(8)), math.radians(60.0)
"""Directions of the camera, seen from the region."""
MOST_POINTS = 400  # places on the road at which the view is checked for obstacles
EQUAL_VIEW = 0.05  # share of the road by which views that hide less than others are as good as the best
FIELD_OF_VIEW = math.radians(35.0)  # across the picture
ROOM = 1.07  # around the region and the sensors
CLOSE_REACH = 300.0  # metres from the camera of a close-up, as far as anything is shown
FOOT_ROOM = np.array((0.0, 0.0, 1.0))  # metres above the foot of a sensor
SENSOR_ROOM = 0.5  # metres round a sensor that its own body and bracket take up
UNSEEN_TYPES = {"LIGHT", "CAMERA", "SPEAKER", "LIGHT_PROBE"}


@dataclass(frozen=True, eq=False)
class Shot:
    """Settings of a picture, without the scene.

    Parameters
    ----------
    viewpoints : tuple of Viewpoint
        In order of preference; the first that hides few enough of the points is taken, see `slack`.
    reach : float, metres
        From the camera, as far as anything is shown.
    sensors : (k, 3) float64, metres
        Optical centres; in a close-up that of one sensor, then a point low above its foot.
    points : (n, 3) float64, metres
        Points that should be visible.
    size : (int, int), pixels
        Width and height of the picture.
    slack : float
        Share of the points that a viewpoint may hide more than the best one.
    """

    viewpoints: tuple[Viewpoint, ...]
    reach: float
    sensors: Float
    points: Float
    size: tuple[int, int]
    slack: float = 0.0

    def as_json(self) -> list[Any]:
        """Return it as a JSON value for `from_json`."""
        views = [[array.tolist() for array in (view.place, view.axes, view.slopes)] for view in self.viewpoints]
        return [views, self.reach, self.sensors.tolist(), self.points.tolist(), self.size, self.slack]

    @classmethod
    def from_json(cls, value: list[Any]) -> Shot:
        """Return what `as_json` wrote down."""
        views, reach, sensors, points, (width, height), slack = value
        viewpoints = tuple(Viewpoint(*(np.array(array) for array in view)) for view in views)
        sensors, points = (np.array(xyz, dtype=np.float64).reshape(-1, 3) for xyz in (sensors, points))
        return cls(viewpoints, reach, sensors, points, (width, height), slack)


@dataclass(frozen=True, eq=False)
class Taken:
    """Viewpoint of a picture that was taken, and what it hides.

    Parameters
    ----------
    viewpoint : int
        Number of the shot's viewpoint.
    hidden : (k,) bool
        Sensors that something stands in front of.
    """

    viewpoint: int
    hidden: Boolean

    def as_json(self) -> list[Any]:
        """Return it as a JSON value for `from_json`."""
        return [self.viewpoint, self.hidden.tolist()]

    @classmethod
    def from_json(cls, value: list[Any]) -> Taken:
        """Return what `as_json` wrote down."""
        return cls(value[0], np.array(value[1], dtype=bool))


@dataclass(frozen=True, eq=False)
class RenderedPictures:
    """The rendered view and the close-ups of each sensor, without labels.

    Parameters
    ----------
    view : path
        Picture of the whole site.
    sight : Sight
        Where sensors and targets are on it.
    close_ups : tuple of Image
        In the order of the sensors, at most `close_ups.MOST`.
    places : mapping of str to (float, float)
        Where each sensor is on its close-up, by its label, in shares of width and height from the lower left.
    """

    view: Path
    sight: Sight
    close_ups: tuple[Image.Image, ...]
    places: Mapping[str, tuple[float, float]]


def take(shots: Sequence[Shot], scene: bpy.types.Scene, raws: Sequence[Path]) -> list[Taken]:
    """Render pictures of a scene without labels, and return how each was taken.

    The pictures are taken in a scene that shares the objects and is removed afterwards, under its own camera, light and
    settings: the user's scene is not touched and every scene is lit alike. Cycles renders on the processor, because the
    other engines end the process where there is no OpenGL.

    Parameters
    ----------
    scene : bpy.types.Scene
        Holds the result of `write_result`.
    """
    taken = []
    with _stage(scene) as stage:
        add_daylight(stage, stage.collection)
        camera = _add_camera(stage)
        _set_up(stage)
        for shot, raw in zip(shots, raws, strict=True):
            hidden = np.array([_hidden(stage, shot.points, viewpoint).mean() for viewpoint in shot.viewpoints])
            number = int(np.argmax(hidden <= hidden.min() + shot.slack))
            taken.append(Taken(number, _hidden(stage, shot.sensors, shot.viewpoints[number])))
            _aim(camera, shot.viewpoints[number], shot.reach)
            stage.render.resolution_x, stage.render.resolution_y = shot.size
            stage.render.filepath = str(raw)
            with held_signals():
                bpy.ops.render.render(scene=stage.name, write_still=True)
    return taken


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


def shots_of(site: Site, deployment: Deployment) -> list[Shot]:
    """Return a shot that has the whole region and all sensors in its picture, and one close to each sensor."""
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
    road = site.targets.xyz[:: math.ceil(len(site.targets) / MOST_POINTS)]
    whole = Shot(around, reach, sensors, road, (WIDTH, HEIGHT), EQUAL_VIEW)
    near = []
    for sensor in deployment.sensors[:MOST]:
        marked = np.vstack((sensor.xyz, sensor.foot + FOOT_ROOM))
        near.append(Shot(tuple(viewpoints(site, sensor)), max(reach, CLOSE_REACH), marked, marked, TILE))
    return [whole, *near]


def raw_files(folder: Path, shots: Sequence[Shot]) -> list[Path]:
    """Return the files of the raw pictures of shots."""
    return [folder / f"view{number}.png" for number in range(len(shots))]


def labelled_pictures(
    shots: Sequence[Shot], taken: Sequence[Taken], raws: Sequence[Path], site: Site, deployment: Deployment
) -> RenderedPictures:
    """Return rendered pictures with the places of sensors on them."""
    whole, *near = shots
    view = whole.viewpoints[taken[0].viewpoint]
    sight = Sight(view.project(whole.sensors), taken[0].hidden, view.project(site.targets.xyz))
    places, images = {}, []
    for shot, how, raw, sensor in zip(near, taken[1:], raws[1:], deployment.sensors, strict=False):
        x, y = shot.viewpoints[how.viewpoint].project(shot.sensors)[0]
        places[sensor.label] = (float(x), float(y))
        with Image.open(raw) as picture:
            images.append(picture.copy())
    return RenderedPictures(raws[0], sight, tuple(images), places)


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
    render.use_persistent_data = True  # between the pictures, which show the same objects
    render.image_settings.file_format = "PNG"
    render.image_settings.color_mode = "RGBA"
    render.film_transparent = True
    stage.view_settings.view_transform = "Standard"
    stage.cycles.device = "CPU"
    stage.cycles.samples = sample_count()
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


def sample_count() -> int:
    """Return the number of samples of each pixel."""
    return min(SAMPLES, DENOISED_SAMPLES) if has_denoiser() else SAMPLES


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
