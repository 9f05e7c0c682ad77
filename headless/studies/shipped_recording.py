"""Simulate the shipped recording: sensors mounted inexactly, a building gone, trees planted.

python -m headless.studies.shipped_recording PLAN.blend RUN.npz SWEEPS
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

from headless import runtime
from headless.detection.recordings import MountedSensors, SampledRun, Simulator, sampled_runs

import bpy
import numpy as np
import shapely

from seip_addon.core.base.arrays import Float, Integer
from seip_addon.core.geometry.plan import surface_height
from seip_addon.core.geometry.solids import prism
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scans.scanner import ReflectiveSurface
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.scans.simulation import ScanSettings
from seip_addon.core.sensing.scans.static_scene import static_scene
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.site.scene_geometry import Mesh, SceneGeometry, joined
from seip_addon.scene.read import read_scene
from seip_addon.scene.sensors import read_sensors

SEED = 1
INTERVAL, SWEEPS = 1.5, 20
"""Seconds between sweeps, and their number."""

DISTANCE, ANGLE, GAIN = 0.4, math.radians(3.0), 0.5
"""Error of position (metres) and orientation, and received power as a multiple of the plan's."""
TREES = 2

_LEAST_RAYS = 500  # that meet an object whose removal a recording can show, and a new tree
_NEAR, _FAR = 8.0, 35.0  # metres from a sensor to a new tree
_OCCLUDED = 2.5  # metres from a new tree to other objects
_RADIUS, _HEIGHT, _SIDES = 1.3, 6.0, 10
RESOLUTION = 1 / 128  # metres: resolution of recorded coordinates, as sensors have it


def main(argv: list[str]) -> None:
    """Write the recording of one installation of a plan in a run of traffic."""
    plan, run, output = map(Path, argv)
    runtime.check_folder(output)
    runtime.open_scene(plan)
    geometry = read_scene(bpy.context.scene).geometry
    planned = read_sensors(bpy.context.scene, load_catalogue(()))
    geometry, sensors = changed_site(geometry, planned, np.random.default_rng(SEED))
    (sampled,) = sampled_runs([run], geometry.origin, INTERVAL)
    record_sweeps(output, geometry, sensors, replace(sampled, times=sampled.times[:SWEEPS]))


def changed_site(
    geometry: SceneGeometry, planned: tuple[MountedSensor, ...], random: np.random.Generator
) -> tuple[SceneGeometry, tuple[MountedSensor, ...]]:
    """Draw the scene and the sensors of an installation, which differ from the plan.

    Poses are off by `DISTANCE` and `ANGLE` in random directions, a building is gone, and trees are new.
    """
    static = static_scene(geometry, planned)
    surface = ReflectiveSurface(make_ray_caster(static.triangles), static.reflectivity)
    met = [_met(surface, sensor) for sensor in planned]
    buildings = [
        mesh
        for mesh in geometry.occluders
        if mesh.name.startswith("Building") and _rays_on(mesh, static.triangles, met)
    ]
    gone = buildings[int(random.integers(len(buildings)))]
    trees = np.array([_tree(geometry, planned, random) for _ in range(TREES)])
    added = [_tree_mesh(geometry, number, xy) for number, xy in enumerate(trees, 1)]
    kept = [mesh for mesh in geometry.occluders if mesh is not gone]
    sensors = tuple(_off(sensor, random) for sensor in planned)
    runtime.print_line(f"{gone.name} is gone, trees at {trees.round(1).tolist()}")
    return replace(geometry, occluders=(*kept, *added)), sensors


def record_sweeps(folder: Path, geometry: SceneGeometry, sensors: tuple[MountedSensor, ...], run: SampledRun) -> None:
    """Write a recording of a run of traffic: a folder of npz sweeps for each sensor, in the sensor's axes."""
    simulator = Simulator(geometry, ScanSettings(seed=SEED, rolling_shutter=True), sensors)
    placed = MountedSensors("installed", sensors)
    for number in range(len(run.times)):
        frame = simulator.frame(placed, run, number)
        for index, sensor in enumerate(sensors):
            own = frame.sensor == index
            points = (frame.points[own] - sensor.xyz) @ sensor.orientation
            rounded = np.round(points / RESOLUTION) * RESOLUTION
            intensity = np.round(frame.intensity[own] * 255)
            path = folder / sensor.label / f"{number:06d}.npz"
            path.parent.mkdir(parents=True, exist_ok=True)
            np.savez_compressed(path, points=np.column_stack([rounded, intensity]).astype(np.float32))
    times = "".join(f"{time:.3f}\n" for time in run.times - run.times[0])
    for sensor in sensors:
        (folder / sensor.label / "timestamps.txt").write_text(times, encoding="utf-8")


def _met(surface: ReflectiveSurface, sensor: MountedSensor) -> Integer:
    """Return the triangles that a grid of rays from a sensor meets."""
    azimuth, elevation = np.meshgrid(np.radians(np.arange(0, 360, 0.5)), np.radians(np.arange(-25, 15, 0.5)))
    level = np.cos(elevation).ravel()
    directions = np.stack(
        [level * np.cos(azimuth).ravel(), level * np.sin(azimuth).ravel(), np.sin(elevation).ravel()], axis=1
    )
    _, triangle = surface.caster.cast(sensor.xyz, directions, 100.0)
    return triangle[triangle >= 0]


def _rays_on(mesh: Mesh, triangles: Float, met: list[Integer]) -> bool:
    rows = {row.tobytes() for row in mesh.triangles}
    own = np.array([row.tobytes() in rows for row in triangles])
    return any(own[triangle].sum() >= _LEAST_RAYS for triangle in met)


def _tree(geometry: SceneGeometry, planned: tuple[MountedSensor, ...], random: np.random.Generator) -> Float:
    """Draw a place for a tree: near a sensor and in its view, off the carriageway and clear of other objects."""
    solid = shapely.union_all(
        [shapely.MultiPoint(mesh.triangles[..., :2].reshape(-1, 2)).convex_hull for mesh in geometry.occluders]
    )
    while True:
        sensor = planned[int(random.integers(len(planned)))]
        far, angle = random.uniform(_NEAR, _FAR), random.uniform(0, math.tau)
        xy = sensor.xyz[:2] + far * np.array([math.cos(angle), math.sin(angle)])
        on_road = np.isfinite(surface_height(xy[None], joined(geometry.roads))[0])
        on_ground = np.isfinite(surface_height(xy[None], joined(geometry.ground))[0])
        sight = shapely.LineString([sensor.xyz[:2], xy])
        clear = min(float(np.linalg.norm(xy - one.xyz[:2])) for one in planned) >= _NEAR
        if (
            clear
            and on_ground
            and not on_road
            and sight.distance(solid) > 0
            and shapely.Point(xy).distance(solid) > _OCCLUDED
        ):
            return xy


def _tree_mesh(geometry: SceneGeometry, number: int, xy: Float) -> Mesh:
    angle = np.linspace(0, math.tau, _SIDES, endpoint=False)
    outline = xy + _RADIUS * np.column_stack([np.cos(angle), np.sin(angle)])
    ground = float(surface_height(xy[None], joined(geometry.ground))[0])
    solid = prism(outline, ground, ground + _HEIGHT, side="leaves")
    triangles = [
        solid.vertices[[face[0], face[corner], face[corner + 1]]]
        for face in solid.faces
        for corner in range(1, len(face) - 1)
    ]
    return Mesh(f"Planted tree {number}", np.array(triangles))


def _off(sensor: MountedSensor, random: np.random.Generator) -> MountedSensor:
    shift, axis = (vector / np.linalg.norm(vector) for vector in random.normal(size=(2, 3)))
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    rotation = np.eye(3) + math.sin(ANGLE) * cross + (1 - math.cos(ANGLE)) * (cross @ cross)
    return replace(
        sensor,
        xyz=sensor.xyz + DISTANCE * shift,
        orientation=rotation @ sensor.orientation,
        model=sensor.model.amplified(GAIN),
    )


if __name__ == "__main__":
    runtime.run(main)
