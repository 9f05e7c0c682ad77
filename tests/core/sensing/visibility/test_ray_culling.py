"""Rays that are left out pass by every patch."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.sensing.visibility.beam_culling import Patches
from seip_addon.core.sensing.visibility.ray_culling import rays_near


def through(patch: tuple[np.ndarray, ...], random: np.random.Generator) -> np.ndarray:
    """Return points within patches, on their rims too."""
    azimuth, distance, radius, bottom, top = patch
    turn, share = random.uniform(0, 2 * math.pi, len(azimuth)), random.choice([0.0, 0.5, 1.0], len(azimuth))
    x = distance * np.cos(azimuth) + share * radius * np.cos(turn)
    y = distance * np.sin(azimuth) + share * radius * np.sin(turn)
    z = bottom + random.choice([0.0, 0.3, 1.0], len(azimuth)) * (top - bottom)
    return np.column_stack([x, y, z])


@given(st.integers(0, 2**32 - 1))
def test_no_ray_through_a_patch_is_left_out(seed: int) -> None:
    random = np.random.default_rng(seed)
    count = int(random.integers(1, 30))
    azimuth = random.choice([0.0, math.pi, -math.pi, math.pi / 2, random.uniform(-7, 7)], count)
    distance = random.choice([0.0, 0.5, 1.0, random.uniform(0, 100)], count)
    radius = np.full(count, random.choice([1.0, 0.3]))
    bottom = random.uniform(-10, 10, count) * random.choice([0.0, 1.0], count)
    top = bottom + random.choice([0.0, 2.0], count)
    patches = Patches(np.arange(count), azimuth, distance, radius, bottom, top)
    points = through((azimuth, distance, radius, bottom, top), random)
    points = points[np.linalg.norm(points, axis=1) > 1e-3]
    turns = random.integers(-2, 3, len(points)) * (2 * math.pi)
    towards = np.arctan2(points[:, 1], points[:, 0]) + turns
    height = np.arctan2(points[:, 2], np.hypot(points[:, 0], points[:, 1]))
    assert rays_near(patches, towards, height, 200.0).tolist() == list(range(len(points)))


def test_rays_beside_above_and_beyond_are_left_out() -> None:
    patches = Patches(
        np.zeros(2, dtype=np.int64),
        np.zeros(2),
        np.array([20.0, 20.0]),
        np.ones(2),
        np.array([-5.0, 1.0]),
        np.array([-4.5, -1.0]),  # of the second no return is possible
    )
    azimuth = np.radians([0.0, 10.0, -10.0, 180.0, 0.0, 0.0])
    elevation = np.radians([-13.0, -13.0, -13.0, -13.0, 0.0, -40.0])
    assert rays_near(patches, azimuth, elevation, 200.0).tolist() == [0]
    assert rays_near(patches, azimuth, elevation, 18.0).tolist() == []
