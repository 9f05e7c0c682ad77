"""The small junction as a file with runs of traffic beside it, for the commands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import shapely

from seip_addon.core.sensing.traffic.trajectories import RoadUser, Trajectories
from seip_addon.core.site.scene_geometry import Mesh, SceneGeometry
from seip_addon.scene import contract
from seip_addon.scene.blend_file import save_blend
from tests.builders.scene_by_hand import make_scene
from tests.builders.small_junction import ORIGIN, flat_triangles, make_geometry

REACH = 36.0
SECONDS = 30.0
LANES = (-5.0, -2.0, 2.0, 5.0)


def save_small_scene(folder: Path, *, title: str = "Small junction", kinds: Sequence[str] = ("",)) -> Path:
    """Write ``small.blend`` and four runs of each kind, ``small_trafficKIND/run-N.npz``; return the scene."""
    path = folder / "small.blend"
    geometry = replace(make_geometry(REACH), name=title)
    _add_areas(make_scene(geometry), geometry)
    save_blend(path)
    for first, kind in enumerate(kinds):
        runs = folder / f"small_traffic{kind}"
        runs.mkdir()
        for number in (1, 2, 3, 4):
            make_run(10 * first + number, SECONDS).save(runs / f"run-{number}.npz")
    return path


def make_run(seed: int, seconds: float) -> Trajectories:
    """Return slow cars and buses in all lanes, in coordinates of the map."""
    random = np.random.default_rng(seed)
    kinds = (("car", 4.5, 1.8, 1.5), ("bus", 12.0, 2.5, 3.2))
    users, position, yaw, speed = [], [], [], []
    for lane in LANES:
        for heading in (0.0, np.pi / 2):
            along = np.array([np.cos(heading), np.sin(heading), 0.0])
            across = np.array([-np.sin(heading), np.cos(heading), 0.0])
            start, far = random.uniform(-30, 30, 2)
            name, *size = kinds[len(users) % 2]
            users.append(RoadUser(f"{name} {len(users)}", name, *size))
            position += [start * along + lane * across, far * along + lane * across]
            yaw += [heading + np.pi * (far < start)] * 2
            speed += [abs(far - start) / seconds] * 2
    return Trajectories(
        users=tuple(users),
        origin=np.zeros(3),
        first=np.arange(0, 2 * len(users) + 1, 2),
        time=np.tile([0.0, seconds], len(users)),
        position=np.array(position) + ORIGIN,
        yaw=np.array(yaw),
        pitch=np.zeros(2 * len(users)),
        speed=np.array(speed),
        source=f"by hand, seed {seed}",
    )


def _add_areas(scene: bpy.types.Scene, geometry: SceneGeometry) -> None:
    """Add what `make_scene` leaves out: the region as it is, areas of posts, weights and what is forbidden, poles."""
    region = contract.find_or_make(scene, contract.REGION)
    for item in list(region.objects):
        bpy.data.objects.remove(item)
    for item in contract.find(scene, contract.ROADS).objects:
        region.objects.link(item)
    pavements = contract.find_or_make(scene, contract.CANDIDATE_AREAS)
    for item in contract.find(scene, contract.GROUND).objects:
        pavements.objects.link(item)
    (central,), (driveway,) = geometry.weighted_regions, geometry.forbidden_areas
    _link_areas(scene, contract.WEIGHTED_REGIONS, [Mesh(central.name, _rectangle(central.polygon))])
    _link_areas(scene, contract.FORBIDDEN_AREAS, [Mesh(driveway.name, _rectangle(driveway.polygon))])
    poles = contract.find_or_make(scene, contract.POLES)
    for pole in geometry.poles:
        empty = bpy.data.objects.new(pole.name, None)
        empty.location = pole.base
        poles.objects.link(empty)


def _link_areas(scene: bpy.types.Scene, name: str, areas: Sequence[Mesh]) -> None:
    collection = contract.find_or_make(scene, name)
    for area in areas:
        mesh = bpy.data.meshes.new(area.name)
        corners = area.triangles.reshape(-1, 3)
        mesh.from_pydata(corners.tolist(), [], np.arange(len(corners)).reshape(-1, 3).tolist())
        collection.objects.link(bpy.data.objects.new(area.name, mesh))


def _rectangle(polygon: shapely.Polygon) -> np.ndarray:
    return flat_triangles(polygon.bounds, z=0.5)
