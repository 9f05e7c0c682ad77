"""A street of boxes, recorded by the scanner of the project with a given pose, gain and traffic."""

import math
from dataclasses import replace

import numpy as np

from seip_addon.core.sensing.lidar.beams import BeamPattern
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.lidar.noisy_returns import measured_returns
from seip_addon.core.sensing.recordings.background import background_of
from seip_addon.core.sensing.recordings.ray_grid import RayGrid
from seip_addon.core.sensing.scans.scanner import ReflectiveSurface, Scanner
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.site.scene_geometry import Mesh
from tests.builders.scan_frames import rotation
from tests.builders.street_recording import memory_record

ROAD, WALLS = 0.17, 0.3


def box_mesh(name, x, y, length, width, height, yaw=0.0, bottom=0.0):
    """Return a closed box whose normals point outwards."""
    corners = np.array([(a, b, c) for a in (-0.5, 0.5) for b in (-0.5, 0.5) for c in (0.0, 1.0)])
    corners = corners * (length, width, height) @ rotation(yaw).T + (x, y, bottom)
    faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    return Mesh(name, np.array([corners[list(part)] for a, b, c, d in faces for part in ((a, b, c), (a, c, d))]))


def ground_mesh(slope=0.02, half=70.0):
    """Return the ground, which rises towards the east."""
    corners = np.array([(x, y, slope * x) for x, y in ((-half, -half), (half, -half), (half, half), (-half, half))])
    return Mesh("ground", corners[[[0, 1, 2], [0, 2, 3]]], np.full(2, ROAD))


def street_meshes():
    """Return buildings and posts around a crossing."""
    return (
        box_mesh("north-east", 24, 22, 14, 12, 9, 0.1),
        box_mesh("north-west", -20, 25, 18, 10, 12, -0.05),
        box_mesh("south-east", 28, -20, 10, 16, 7),
        box_mesh("south-west", -26, -24, 16, 12, 10, 0.2),
        *(
            box_mesh(f"post {n}", x, y, 0.3, 0.3, 6)
            for n, (x, y) in enumerate(((9, 9), (-9, 11), (12, -10), (-12, -9)))
        ),
    )


def surface_of(meshes):
    """Return the surface of meshes, and its triangles."""
    triangles = np.concatenate([mesh.triangles for mesh in meshes])
    kinds = [np.full(len(m.triangles), WALLS) if m.reflectivity is None else m.reflectivity for m in meshes]
    return ReflectiveSurface(make_ray_caster(triangles, "auto"), np.concatenate(kinds))


def mounted(key="os1_32_rev7", xyz=(-8.0, -7.0, 6.0), yaw=0.3, label="S1", **changes):
    """Return an upright sensor of the street."""
    model = replace(load_catalogue()[key], **changes)
    return MountedSensor(label, model, np.array(xyz), rotation(yaw))


def moved(sensor, random, distance=0.5, degrees=4.0):
    """Return a sensor off its pose in random directions, by up to a distance in metres and an angle."""
    axis, direction = (part / np.linalg.norm(part) for part in random.normal(size=(2, 3)))
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = math.radians(degrees) * random.random()
    turn = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    xyz = sensor.xyz + distance * random.random() * direction
    return replace(sensor, xyz=xyz, orientation=turn @ sensor.orientation), np.concatenate(
        [xyz - sensor.xyz, angle * axis]
    )


def street_ranges(surface, sensor, sweeps, seed, vehicles=0):
    """Return ranges (sweeps, rays) of a sensor, infinite without a return, and the intensity of each ray.

    The seed is that of noise, losses and vehicles.

    Each sweep has a number of ``vehicles`` at random places of the crossing, or the given ones: x, y, length, width,
    height, yaw.
    """
    model = sensor.model
    random = np.random.default_rng(seed)
    scan = Scanner(sensor, surface).scan((), (), np.zeros((0, 1, 3)), 0)
    directions = BeamPattern(model).directions(np.arange(len(scan.distance))) @ sensor.orientation.T
    ranges = np.full((sweeps, len(scan.distance)), np.inf, dtype=np.float32)
    for sweep in range(sweeps):
        distance, chance = scan.distance.copy(), scan.chance.copy()
        if present := _vehicles(random, sweep, vehicles):
            traffic = [box_mesh("car", *one, 0.02 * one[0]) for one in present]
            met, _ = make_ray_caster(np.concatenate([m.triangles for m in traffic]), "auto").cast(
                sensor.xyz, directions, model.max_range
            )
            nearer = met < distance
            distance[nearer], chance[nearer] = met[nearer], 0.9
        ray, measured = measured_returns(model, distance, chance, random)
        ranges[sweep, ray] = measured
    return ranges, scan.intensity


def _vehicles(random, sweep, vehicles):
    if not isinstance(vehicles, int):
        return vehicles[sweep]
    places = random.uniform(-30, 30, (vehicles, 2)) * ((1, 0.15) if sweep % 2 else (0.15, 1))
    return [(x, y, 4.5, 1.8, 1.5, 0.0 if sweep % 2 else math.pi / 2) for x, y in places]


def street_background(surface, sensor, sweeps=20, seed=0, vehicles=0):
    """Return the background of a sensor whose rays are known."""
    model = sensor.model
    order = np.argsort(model.elevations)
    grid = RayGrid(model.elevations[order], model.azimuth_offsets[order] + model.first_azimuth, model.azimuth_count)
    ranges, _ = street_ranges(surface, sensor, sweeps, seed, vehicles)
    by_ring = ranges.reshape(sweeps, model.channels, -1)[:, order].reshape(sweeps, -1)
    return background_of(grid, np.ascontiguousarray(by_ring), sweeps / 2)


def street_record(surface, sensor, sweeps=20, seed=0, vehicles=0):
    """Return the recording of a sensor."""
    ranges, intensity = street_ranges(surface, sensor, sweeps, seed, vehicles)
    directions = BeamPattern(sensor.model).directions(np.arange(ranges.shape[1]))
    clouds, intensities = [], []
    for row in ranges:
        ray = np.flatnonzero(np.isfinite(row))
        clouds.append((directions[ray] * row[ray, None]).astype(np.float32))
        intensities.append(intensity[ray].astype(np.float32))
    return memory_record(sensor.label, clouds, 2.0, intensities)
