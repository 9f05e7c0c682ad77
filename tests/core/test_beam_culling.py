"""No ray that passes near a target is culled, and few that do not are kept."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.beam_culling import near_rays
from seip_addon.core.lidar import LidarModel, beam_directions


def random_model(random: np.random.Generator) -> LidarModel:
    channels = int(random.integers(1, 12))
    return LidarModel(
        key="random",
        name="Random",
        manufacturer="Test",
        source="Test",
        elevations=random.uniform(-1.5, 1.5, channels),
        min_range=0.0,
        max_range=60.0,
        points_per_second=10.0 * channels * int(random.integers(1, 150)),
        rotation_rate=10.0,
        price_range=(1.0, 2.0),
        azimuth_offsets=random.uniform(-7, 7, channels),
    )


def passing_distance(directions: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Least distance between each half-line and each target, (rays, targets)."""
    along = np.maximum(directions @ offsets.T, 0.0)
    return np.linalg.norm(directions[:, None] * along[:, :, None] - offsets[None], axis=2)


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.05, 1.0, 4.0]))
def test_the_rays_marked_are_those_that_pass_near(seed: int, delta: float) -> None:
    random = np.random.default_rng(seed)
    model, yaw = random_model(random), random.uniform(-7, 7)
    offsets = random.normal(0, 12, (20, 3))
    offsets[0] = (0.0, 0.0, -6.0)  # straight below
    offsets[1] *= 0.3 * delta / np.linalg.norm(offsets[1])  # δ about it holds the sensor
    near = near_rays(model, yaw, offsets, delta)
    distance = passing_distance(beam_directions(model, yaw).reshape(-1, 3), offsets)
    for target in range(len(offsets)):
        wanted = np.zeros(len(offsets), dtype=bool)
        wanted[target] = True
        marked = near.rays(wanted)
        assert marked[distance[:, target] < delta].all()
        if np.linalg.norm(offsets[target]) > delta:
            assert not marked[distance[:, target] > delta * (1 + 1e-3)].any()
    union = np.any([near.rays(np.arange(len(offsets)) == target) for target in range(len(offsets))], axis=0)
    assert (near.rays(np.ones(len(offsets), dtype=bool)) == union).all()
    assert union[near.likeliest_rays(within=np.inf)].all()


def test_targets_out_of_range_need_no_ray() -> None:
    model = replace(random_model(np.random.default_rng(0)), min_range=0.5)
    offsets = np.array([[61.5, 0.0, 0.0], [0.1, 0.0, 0.0]])
    assert not near_rays(model, 0.0, offsets, 0.3).rays(np.array([True, True])).any()


def test_the_likeliest_ray_ends_at_the_target_on_a_level_road() -> None:
    model = LidarModel(
        key="k",
        name="N",
        manufacturer="M",
        source="S",
        elevations=np.radians([-5.0, -20.0]),
        min_range=0.0,
        max_range=100.0,
        points_per_second=7200.0,
        rotation_rate=10.0,
        price_range=(1.0, 2.0),
    )
    radius = 4 / math.tan(math.radians(20))
    offsets = np.array([[0.0, radius, -4.0], [30.0, 0.0, -4.0]])
    near = near_rays(model, 0.0, offsets, 1.0)
    assert near.likeliest_rays(within=1.0).tolist() == [360 + 90]
    assert near.miss.min() == pytest.approx(0, abs=1e-9)
