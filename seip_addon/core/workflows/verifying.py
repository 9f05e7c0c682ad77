"""Verification of an installation: what its recording shows, compared with what its plan promised."""

from __future__ import annotations

import math
import re
from collections.abc import Generator, Mapping, Sequence
from dataclasses import replace
from itertools import chain, count
from typing import TypeVar

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..base.arrays import Boolean, Float
from ..base.errors import SeipError
from ..base.progress import Progress
from ..geometry.plan import surface_height
from ..sensing.recordings.background import Background, learn_background
from ..sensing.recordings.comparison import (
    FARTHER,
    VEHICLE,
    Change,
    RayComparison,
    compare_rays,
    gone_objects,
    new_objects,
)
from ..sensing.recordings.recording import Recording
from ..sensing.recordings.registration import Registration, register
from ..sensing.recordings.unit_gain import fitted_gain
from ..sensing.recordings.verification import (
    CoverageSteps,
    Gain,
    InstalledSensor,
    RecordedBackground,
    Verification,
)
from ..sensing.scans.scanner import ReflectiveSurface
from ..sensing.scans.sensor import MountedSensor
from ..sensing.scans.static_scene import StaticScene, static_scene
from ..sensing.visibility.ray_casting import make_ray_caster
from ..sensing.visibility.settings import Engine, VisibilitySettings
from ..sensing.visibility.visibility_model import VisibilityModel
from ..site.scene_geometry import FROM_SURVEY, Mesh, SceneGeometry, joined
from ..site.targets import Targets, generate_targets

Known = TypeVar("Known")

_FOUND = re.compile(r"Found (\d{1,9})\b")  # name of an object that a verification added
_BOX_MARGIN = 1.0  # metres around a box that an earlier verification added
_MOST_PRICED = 20  # changes whose cost in coverage is computed, those with most rays


def verify(
    geometry: SceneGeometry,
    planned: Sequence[MountedSensor],
    recording: Recording,
    settings: VisibilitySettings,
    *,
    spacing: float,
    engine: Engine = "auto",
) -> Generator[Progress, None, Verification]:
    """Compare a recording with the scene and the sensors that it was planned with.

    Parameters
    ----------
    geometry : SceneGeometry
        The scene of the plan.
    planned : sequence of MountedSensor
        Sensors of the plan; the recording has a folder for each, or one sensor.
    spacing : float, metres
        Distance between neighbouring targets.

    Raises
    ------
    SeipError
        The recording has a sensor that is not planned, is of another site, or is too short.
    """
    own = of_recorded(recording, {one.label: one for one in planned}, "the plan")
    pairs = [(own[record.name], record) for record in recording.sensors]
    static = static_scene(geometry, planned)
    surface = ReflectiveSurface(make_ray_caster(static.triangles, engine), static.reflectivity)
    fitted: list[tuple[Registration, Background]] = []
    for sensor, record in pairs:
        background = yield from learn_background(record, sensor.model)
        fitted.append((register(surface, sensor, background), background))
    comparisons = [compare_rays(surface, pose.sensor, background) for pose, background in fitted]
    road = joined(geometry.roads)
    earlier = _earlier_boxes(geometry)
    fresh = [one for one in new_objects(comparisons, lambda xy: surface_height(xy, road)) if not _is_at(one, earlier)]
    found = _named(fresh, _first_number(geometry))
    changes = (*found, *gone_objects(comparisons, geometry.occluders, static.triangles))
    comparisons = [_without_gone(one, changes) for one in comparisons]
    sensors = []
    for (pose, background), one in zip(fitted, comparisons, strict=True):
        sensors.append(_installed(pose, background, fitted_gain(one)))
    targets = generate_targets(geometry.region, road, spacing, geometry.weighted_regions)
    corrected = _corrected(geometry, static, changes)

    def coverage(scene: SceneGeometry, at: Sequence[MountedSensor]) -> float:
        surfaces = static_scene(scene, planned)
        caster = make_ray_caster(surfaces.triangles, engine)
        model = VisibilityModel(targets.xyz, surfaces.reflectivity, settings, caster)
        seen = np.any([model.see(one.model, one.xyz, one.orientation) for one in at], axis=0)
        return float(np.mean(seen))

    installed = [one.sensor for one in comparisons]
    units = [
        replace(at, model=at.model.amplified(one.gain.value if one.gain else 1.0))
        for at, one in zip(installed, sensors, strict=True)
    ]
    steps = (
        (geometry, [sensor for sensor, _ in pairs]),
        (geometry, installed),
        (corrected, installed),
        (corrected, units),
    )
    figures = []
    for done, (scene, at) in enumerate(steps):
        yield Progress(done, len(steps), "computing coverage", counted=False)
        figures.append(coverage(scene, at))
    figures.append(float(np.mean(_seen_in_recording(targets, comparisons, settings))))
    objects = [change for change in changes if change.kind != VEHICLE][:_MOST_PRICED]
    costs = dict.fromkeys(map(id, changes), float("nan"))
    for done, change in enumerate(objects):
        yield Progress(done, len(objects), "computing what each change costs")
        others = [other for other in changes if other is not change]
        costs[id(change)] = coverage(_corrected(geometry, static, others), installed) - figures[2]
    yield Progress(len(objects), len(objects), "computing what each change costs")
    return Verification(
        sensors=tuple(sensors),
        comparisons=tuple(comparisons),
        changes=changes,
        costs=tuple(costs.values()),
        coverage=CoverageSteps(*figures),
        corrected=corrected,
        warnings=tuple(chain.from_iterable(known.warnings(pose.sensor.label) for pose, known in fitted)),
    )


def _installed(pose: Registration, background: Background, gain: Gain | None) -> InstalledSensor:
    return InstalledSensor(
        id=pose.sensor.label,
        sensor=pose.sensor.model.key,
        local_m=tuple(pose.sensor.xyz.tolist()),
        orientation=tuple(map(tuple, pose.sensor.orientation.tolist())),  # type: ignore[arg-type]  # three rows
        shift_m=tuple(pose.shift[:3].tolist()),
        shift_half_width_m=tuple(pose.half_width[:3].tolist()),
        rotation_deg=tuple(math.degrees(angle) for angle in pose.shift[3:]),  # type: ignore[arg-type]  # three
        rotation_half_width_deg=tuple(math.degrees(angle) for angle in pose.half_width[3:]),  # type: ignore[arg-type]
        match=pose.match,
        background=RecordedBackground(background.sweeps, background.seconds, background.uncertain),
        gain=gain,
    )


def of_recorded(recording: Recording, known: Mapping[str, Known], whose: str) -> dict[str, Known]:
    """Return what is known by label of the sensors of a recording, by their names; one sensor may have any name.

    Raises
    ------
    SeipError
        A sensor has the label of none; ``whose`` says what the labels are from.
    """
    names = [record.name for record in recording.sensors]
    if len(names) == len(known) == 1:
        return dict(zip(names, known.values(), strict=True))
    unknown = [name for name in names if name not in known]
    if unknown:
        raise SeipError(
            f"{whose} has the sensors {', '.join(known)}, but the recording has {', '.join(unknown)}: name the folders "
            "of sweeps after the sensors"
        )
    return {name: known[name] for name in names}


def _first_number(geometry: SceneGeometry) -> int:
    """Return the first number after those of the objects that earlier verifications added to a scene."""
    numbers = [int(found[1]) for mesh in geometry.occluders if (found := _FOUND.match(mesh.name))]
    return 1 + max(numbers, default=0)


def _named(changes: Sequence[Change], first: int) -> list[Change]:
    """Return new objects and vehicles with names of their own, objects from a first number on."""
    numbers = {"new": count(first), VEHICLE: count(1)}
    words = {"new": "Found", VEHICLE: "Vehicle"}
    return [replace(one, name=f"{words[one.kind]} {next(numbers[one.kind])}") for one in changes]


def _earlier_boxes(geometry: SceneGeometry) -> BaseGeometry:
    """Return the surroundings, in plan, of the boxes that earlier verifications added to a scene."""
    boxes = [mesh for mesh in geometry.occluders if mesh.source == FROM_SURVEY and _FOUND.match(mesh.name)]
    outlines = [shapely.MultiPoint(mesh.triangles.reshape(-1, 3)[:, :2]).convex_hull for mesh in boxes]
    return shapely.union_all(shapely.buffer(outlines, _BOX_MARGIN))


def _is_at(change: Change, earlier: BaseGeometry) -> bool:
    """Return whether a new object is mostly within the surroundings of earlier boxes.

    A box has the size of the sides that sensors measured, so that its object differs from it once more.
    """
    outline = shapely.MultiPoint(box_triangles(change.box).reshape(-1, 3)[:, :2]).convex_hull
    return bool(outline.intersection(earlier).area > outline.area / 2)


def _without_gone(comparison: RayComparison, changes: Sequence[Change]) -> RayComparison:
    """Return a comparison in which rays towards an object that is gone are farther, even if they do not return."""
    gone = np.concatenate([np.zeros(0, dtype=np.int64), *(change.part for change in changes)])
    result = np.where(np.isin(comparison.triangle, gone), FARTHER, comparison.result)
    return replace(comparison, result=result)


def _corrected(geometry: SceneGeometry, static: StaticScene, changes: Sequence[Change]) -> SceneGeometry:
    """Return a scene with new objects as boxes and without those that are gone."""
    gone = {row.tobytes() for change in changes for row in static.triangles[change.part]}
    occluders = []
    for mesh in geometry.occluders:
        kept = np.array([row.tobytes() not in gone for row in mesh.triangles], dtype=bool)
        if kept.all():
            occluders.append(mesh)
        elif kept.any():
            reflectivity = None if mesh.reflectivity is None else mesh.reflectivity[kept]
            occluders.append(replace(mesh, triangles=mesh.triangles[kept], reflectivity=reflectivity))
    added = [Mesh(one.name, box_triangles(one.box), source=FROM_SURVEY) for one in changes if one.kind == "new"]
    return replace(geometry, occluders=(*occluders, *added))


def box_triangles(box: Float) -> Float:
    """Return the triangles (12, 3, 3) of a box (7,)."""
    x, y, z, length, width, height, yaw = box.tolist()
    signs = np.array([(a, b, c) for c in (-1, 1) for b in (-1, 1) for a in (-1, 1)]) / 2
    local = signs * (length, width, height)
    cos, sin = np.cos(yaw), np.sin(yaw)
    corners = np.column_stack(
        [local[:, 0] * cos - local[:, 1] * sin, local[:, 0] * sin + local[:, 1] * cos, local[:, 2]]
    )
    corners += (x, y, z)
    faces = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    halves = [part for a, b, c, d in faces for part in ((a, b, c), (a, c, d))]
    triangles: Float = corners[np.array(halves)]
    return triangles


def _seen_in_recording(targets: Targets, comparisons: Sequence[RayComparison], settings: VisibilitySettings) -> Boolean:
    """Return the targets (t,) with a background return within δ, in the share of sweeps that detection demands."""
    points = []
    for one in comparisons:
        often = np.isfinite(one.measured) & (one.returned >= settings.detection)
        points.append(one.sensor.xyz + one.directions[often] * one.measured[often, None])
    xyz = np.concatenate(points)
    seen = np.zeros(len(targets), dtype=bool)
    target, point = shapely.STRtree(shapely.points(xyz[:, :2])).query(
        shapely.points(targets.xyz[:, :2]), predicate="dwithin", distance=settings.delta
    )
    near = np.linalg.norm(targets.xyz[target] - xyz[point], axis=1) <= settings.delta
    seen[target[near]] = True
    return seen
