"""No ray that can return from near a target is culled, and few that cannot are kept."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.visibility.beam_culling import (
    NearRays,
    near_rays,
)
from seip_addon.core.sensing.visibility.near_surfaces import NearSurfaces, near_surfaces
from seip_addon.core.site.scene_geometry import DEFAULT_REFLECTIVITY
from tests.oracles.full_scan import beam_directions


def surfaces_near(triangles: np.ndarray, targets: np.ndarray, delta: float) -> NearSurfaces:
    return near_surfaces(triangles, targets, delta, np.full(len(triangles), DEFAULT_REFLECTIVITY))


def random_model(random: np.random.Generator, field_of_view: float = math.tau) -> LidarModel:
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
        field_of_view=field_of_view,
    )


def hits(origin: np.ndarray, directions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Where each ray meets each triangle, (rays, triangles, 3); NaN where it does not."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    normal = np.cross(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = ((a - origin) * normal).sum(axis=1) / (directions @ normal.T)
        point = origin + along[..., None] * directions[:, None]
        inside = along > 0
        for one, other in ((a, b), (b, c), (c, a)):
            inside &= (np.cross(other - one, point - one) * normal).sum(axis=2) >= 0
    return np.where(inside[..., None], point, np.nan)


def rays_by_target(near: NearRays, model: LidarModel, targets: int) -> np.ndarray:
    marked = np.zeros((targets, model.channels, model.azimuth_count), dtype=bool)
    for target, channel, first, width in zip(near.target, near.channel, near.first, near.width, strict=True):
        assert model.all_round or 0 <= first < first + width <= model.azimuth_count
        marked[target, channel, np.arange(first, first + width) % model.azimuth_count] = True
    return marked.reshape(targets, -1)


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.05, 1.0, 4.0]))
def test_every_ray_that_returns_from_near_a_target_is_kept(seed: int, delta: float) -> None:
    random = np.random.default_rng(seed)
    view = random.choice([math.tau, random.uniform(0.02, math.tau), math.radians(359)])
    model, yaw = random_model(random, view), random.uniform(-7, 7)
    origin = random.normal(0, 2, 3)
    level = random.random() < 0.5  # road-like, or a soup
    triangles = random.uniform(-20, 20, (40, 1, 3)) + random.normal(0, 4, (40, 3, 3)) * (1, 1, 0.05 if level else 1)
    inside = random.dirichlet([1, 1, 1], 30)
    targets = (triangles[random.integers(0, 40, 30)] * inside[:, :, None]).sum(axis=1)
    targets += random.normal(0, 0.3 * delta, (30, 3))
    targets[0] = origin + random.normal(0, 0.3 * delta, 3)  # δ about it may hold the sensor
    surfaces = surfaces_near(triangles, targets, delta)
    near = near_rays(model, origin, yaw, surfaces, all_of(surfaces))

    points = hits(origin, beam_directions(model, yaw).reshape(-1, 3), triangles)
    distance = np.linalg.norm(points[None] - targets[:, None, None], axis=3)
    returns = (distance < delta).any(axis=2)
    assert rays_by_target(near, model, 30)[returns].all()


def all_of(surfaces):
    return np.ones(len(surfaces.xyz), dtype=bool)


def road(half: float) -> np.ndarray:
    corners = np.array([[-half, -half, 0.0], [half, -half, 0], [half, half, 0], [-half, half, 0]])
    return corners[[[0, 1, 2], [0, 2, 3]]]


def test_hardly_a_ray_is_kept_that_passes_over_its_target() -> None:
    random = np.random.default_rng(4)
    targets = np.column_stack([random.uniform(-60, 60, (400, 2)), np.zeros(400)])
    model = load_catalogue()["type3"]
    origin = np.array([0.0, 0.0, 5.0])
    surfaces = surfaces_near(road(80.0), targets, 1.0)
    near = near_rays(model, origin, 0.3, surfaces, all_of(surfaces))
    down = np.tan(model.elevations)[near.channel]
    radius = -5.0 / down
    ends = near.target[down < 0]
    gap = np.abs(radius[down < 0] - np.hypot(*(targets[ends, :2] - origin[:2]).T))
    assert (down < 0).all()
    assert (gap < 1.03).all()


def test_targets_out_of_range_and_without_surface_need_no_ray() -> None:
    model = replace(random_model(np.random.default_rng(0)), min_range=0.5)
    targets = np.array([[61.5, 0.0, 0.0], [0.1, 0.0, 0.0], [9.0, 0.0, 30.0]])
    surfaces = surfaces_near(road(80.0), targets, 0.3)
    assert len(near_rays(model, np.array([0.0, 0.0, 0.1]), 0.0, surfaces, all_of(surfaces))) == 0


def test_least_range_is_measured_along_the_ray() -> None:
    """Straight below a sensor a return is near in plan and as far off as the sensor is high."""
    model = replace(random_model(np.random.default_rng(0)), elevations=np.full(1, -1.4), azimuth_offsets=np.zeros(1))
    surfaces = surfaces_near(road(20.0), np.array([[0.5, 0.0, 0.0]]), 1.0)
    origin = np.array([0.0, 0.0, 6.0])
    for least, some in ((5.0, True), (7.0, False)):
        near = near_rays(replace(model, min_range=least), origin, 0.0, surfaces, all_of(surfaces))
        assert (len(near) > 0) == some
