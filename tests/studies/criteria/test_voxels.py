"""Voxels over targets, and cells of vehicles' views, against cases worked out by hand and slow oracles."""

import math
from dataclasses import replace

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless.studies.criteria.vehicle_grid import CELLS, REFLECTIVITY, VIEW_CELLS, Vehicles, log_misses
from headless.studies.criteria.voxels import Voxels, seen_voxels

import numpy as np

from seip_addon.core.geometry.orientation import orientation
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scans.scanner import ReflectiveSurface
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.site.site import Targets
from tests.builders.traffic_by_hand import make_trajectories
from tests.oracles.full_scan import beam_directions

FLAT = np.array([[[-99, -99, 0], [99, -99, 0], [99, 99, 0]], [[-99, -99, 0], [99, 99, 0], [-99, 99, 0]]], dtype=float)
WALL = np.array([[[7, -9, 0], [7, 9, 0], [7, 9, 9]], [[7, -9, 0], [7, 9, 9], [7, -9, 9]]], dtype=float)
LEVEL = np.eye(3)


def targets(*places):
    xyz = np.array([(x, y, 0.0) for x, y in places])
    return Targets(xyz, np.ones(len(xyz)), np.zeros(len(xyz), dtype=bool), 1.0)


def car_at(x, y, yaw=0.0, until=10.0):
    return make_trajectories([(0.0, x, y, 0.0, yaw, 0.0), (until, x, y, 0.0, yaw, 0.0)])


def surface(triangles):
    return ReflectiveSurface(make_ray_caster(triangles), np.full(len(triangles), 0.5))


def test_a_car_is_in_voxels_that_it_reaches_into_by_half():
    """It is 4 m long and 1.5 m high; a voxel is 1 m wide, so that middles up to 2.5 m ahead are in."""
    voxels = Voxels.over(targets((0, 0), (2.4, 0), (2.6, 0), (0, 1.4), (0, 1.6)))
    trajectories = car_at(0, 0)
    assert voxels.occupant(trajectories, trajectories.at(1.0)).tolist() == [0, 0, -1, 0, -1] * 2
    across = car_at(0, 0, math.pi / 2)
    assert voxels.occupant(across, across.at(1.0)).tolist() == [0, -1, -1, 0, 0] * 2


def model(*degrees):
    elevations = np.radians(degrees)
    return replace(load_catalogue()["type2"], elevations=elevations, azimuth_offsets=np.zeros(len(degrees)))


def test_beams_pass_the_voxels_in_their_way():
    """From 5 m height a beam of 45° down is between 0 and 1 m high at a distance of 4 to 5 m, and between 1 and 2 m at
    3 to 4 m; the next channel, of 20° down, lies above all of these voxels, and the wall hides what is behind."""
    places = [(x, 0.0) for x in (3.5, 4.5, 5.5, 7.5)]
    voxels = Voxels.over(targets(*places))
    origin = np.array([0.0, 0.0, 5.0])
    seen = seen_voxels(voxels, surface(np.concatenate([FLAT, WALL])), [], model(-45, -20), origin, LEVEL)
    assert seen.passed.tolist() == [False, True, False, False, True, False, False, False]
    assert seen.free.tolist() == [False, True, True, False, True, True, True, False]
    assert seen.covered.tolist() == [False, True, True, True, True, True, True, True]
    assert seen.unhidden.shape == (0, 8)


@pytest.mark.parametrize("key", ["vlp16", "type1"])
def test_cells_are_hit_as_every_ray_by_itself_says(key):
    lidar = load_catalogue()[key]
    origin, turned = np.array([0.0, 0.0, 4.0]), orientation(0.4, 0.1)
    places = np.array([[12.0, 3.0, 0.0], [-9.0, 4.0, 0.0]])
    vehicles = Vehicles(places, np.array([0.7, 0.0]), np.array([[4.5, 1.8, 1.5]] * 2))
    wall = WALL - (14.0, 0.0, 0.0)
    found = log_misses(make_ray_caster(np.concatenate([FLAT, wall])), lidar, origin, turned, vehicles)
    rays = beam_directions(lidar).reshape(-1, 3) @ turned.T
    expected = np.zeros_like(found, dtype=float)
    for number in range(2):
        cos, sin = math.cos(vehicles.yaw[number]), math.sin(vehicles.yaw[number])
        axes = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
        low, size = np.array([-2.25, -0.9, 0.0]), vehicles.size[number]
        towards = vehicles.position[number] - origin
        near = rays @ towards > np.linalg.norm(towards) * math.cos(math.asin(3 / np.linalg.norm(towards)))
        for ray in rays[near]:
            start, way = axes.T @ (origin - vehicles.position[number]), axes.T @ ray
            met = [
                (t, axis)
                for axis in range(3)
                for side in (0, 1)
                if way[axis] and (t := (low[axis] + side * size[axis] - start[axis]) / way[axis]) > 0
                if ((start + t * way)[np.arange(3) != axis] >= low[np.arange(3) != axis]).all()
                if ((start + t * way)[np.arange(3) != axis] <= (low + size)[np.arange(3) != axis]).all()
            ]
            if not met:
                continue
            distance, axis = min(met)
            behind = ray[0] < 0 and distance > 7 / -ray[0] and abs(ray[1] / ray[0] * 7) < 9
            if behind or not lidar.min_range <= distance <= lidar.max_range:
                continue
            chance = float(lidar.law.chance(np.array([distance]), np.array([REFLECTIVITY * abs(way[axis])]))[0])
            cell = np.clip(((start + distance * way - low) / size * CELLS).astype(int), 0, np.array(CELLS) - 1)
            for view, (one, other) in enumerate(((0, 1), (0, 2), (1, 2))):
                place = sum(VIEW_CELLS[:view]) + cell[one] * CELLS[other] + cell[other]
                expected[number, place] += max(math.log1p(-chance) if chance < 1 else -30.0, -30.0)
    assert (expected[0] < 0).sum() > 20
    np.testing.assert_allclose(found, np.maximum(expected, -30), rtol=1e-4, atol=1e-4)
