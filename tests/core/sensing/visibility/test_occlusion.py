"""A bundle that is said to be stopped is stopped, ray by ray."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.visibility.beam_culling import Beams, NearRays, Planes
from seip_addon.core.sensing.visibility.occlusion import stopped_by
from seip_addon.core.sensing.visibility.settings import VisibilitySettings

TYPE2 = load_catalogue()["type2"]
ONE_WAY = replace(TYPE2, field_of_view=math.radians(100))
BEAMS, BEAMS_ONE_WAY = (Beams.of([model], 0.4, VisibilitySettings()) for model in (TYPE2, ONE_WAY))
COUNT = 300


def bundles(channel: np.ndarray, first: np.ndarray, width: np.ndarray) -> NearRays:
    patch = np.arange(len(channel))
    return NearRays(patch, patch, channel, first, width, np.zeros(len(channel)))


def directions(rays: NearRays, number: int, view: float = 2 * math.pi) -> np.ndarray:
    """The rays of one bundle, one metre long in plan."""
    step = rays.first[number] + np.arange(rays.width[number])
    begin = 0.4 if view == 2 * math.pi else 0.4 - view / 2 + view / 7500 / 2
    azimuth = begin + TYPE2.azimuth_offsets[rays.channel[number]] + step * view / 7500
    slope = math.tan(BEAMS.elevation[rays.channel[number]])
    return np.column_stack([np.cos(azimuth), np.sin(azimuth), np.full(len(step), slope)])


@given(st.integers(0, 2**32 - 1), st.sampled_from([(BEAMS, 2 * math.pi), (BEAMS_ONE_WAY, ONE_WAY.field_of_view)]))
def test_what_is_proven_hidden_is_hidden(seed: int, turning: tuple[Beams, float]) -> None:
    beams, view = turning
    random = np.random.default_rng(seed)
    rays = bundles(random.integers(0, 32, COUNT), random.integers(-9000, 9000, COUNT), random.integers(1, 400, COUNT))
    origin = random.normal(0, 3, 3)
    middle = np.array([directions(rays, number, view)[rays.width[number] // 2] for number in range(COUNT)])
    triangles = origin + middle[:, None] * random.uniform(2, 40, (COUNT, 1, 1)) + random.normal(0, 6, (COUNT, 3, 3))
    normal = random.normal(0, 1, (COUNT, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal *= np.where((normal * middle).sum(axis=1) < 0, -1, 1)[:, None]
    planes = Planes(normal, random.uniform(0.1, 40, COUNT), np.ones(COUNT), 1e-3)
    stopped = stopped_by(origin, triangles, beams, rays, planes)
    for number in np.flatnonzero(stopped):
        ray = directions(rays, number, view)
        a, b, c = triangles[number] - origin
        facing = np.sign(np.linalg.det([a, b, c]))
        for one, other in ((a, b), (b, c), (c, a)):
            assert (facing * (ray @ np.cross(one, other)) > 0).all()
        across = np.cross(b - a, c - a)
        to_triangle = (a @ across) / (ray @ across)
        towards_plane = ray @ normal[number]
        meets = towards_plane > 0
        assert (to_triangle[meets] < planes.distance[number] / towards_plane[meets]).all()


def test_a_wall_stops_what_is_behind_it_and_nothing_before_it() -> None:
    """Before a wall 10 m away: a road plane 5 m below the sensor is met beyond it, or nearer, by slope."""
    wall = np.array([[[10.0, -30, -20], [10, 30, -20], [10, 0, 60]]])
    channel = np.argsort(BEAMS.elevation)[[0, 10]]  # -25° meets the road 10.7 m away, -12° 23 m
    first = np.rint(-BEAMS.zero[channel] / (2 * math.pi / 7500)).astype(int) - 20
    rays = bundles(channel, first, np.array([41, 41]))
    triangles = np.repeat(wall, 2, axis=0)
    road = np.array([[0.0, 0, -1], [0, 0, -1]])
    origin = np.zeros(3)
    assert stopped_by(
        origin, triangles, BEAMS, rays, Planes(road, np.array([5.0, 5.0]), np.ones(2), 1e-3)
    ).tolist() == [True, True]
    near = Planes(road, np.array([4.0, 4.0]), np.ones(2), 1e-3)  # met at 8.6 m and 19 m
    assert stopped_by(origin, triangles, BEAMS, rays, near).tolist() == [False, True]
    aside = bundles(channel, first + 1800, np.array([41, 41]))  # 86° from the wall's middle
    assert not stopped_by(origin, triangles, BEAMS, aside, near).any()
