"""The rays that are cast for a target are those that pass through its patch; borders and δ count as documented."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from seip_addon.core.sensing.lidar.carla_dropoff import CarlaDropoff
from seip_addon.core.sensing.visibility.beam_culling import near_rays
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.visibility.scanning import is_within
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.visibility_model import VisibilityModel
from tests.builders.traffic_by_hand import make_model
from tests.engines import each_engine
from tests.oracles.full_scan import beam_directions

CLOSE = 1e-6  # metres by which a ray may miss a patch and be cast all the same


def draw_model(random):
    elevations = random.uniform(-1.2, 0.4, 7)
    elevations[:3] = 0.0, -0.0, random.choice([1e-9, -1e-9])
    steps = int(random.integers(40, 200))
    field = math.tau if random.random() < 0.5 else float(random.uniform(1.0, 6.0))
    return make_model(
        elevations=elevations,
        azimuth_offsets=random.uniform(-3, 3, 7),
        points_per_second=70.0 * steps,
        max_range=1e4,
        field_of_view=field,
    )


def draw_patches(random, origin):
    """Patches about a sensor, one of them around it, some of them flat."""
    xyz = origin + random.uniform(-15, 15, (40, 3)) * (1, 1, 0.3)
    xyz[0, :2] = origin[:2] + 0.1
    low = xyz[:, 2] - random.uniform(0, 1, 40)
    return SimpleNamespace(xyz=xyz, low=low, high=low + random.choice([0.0, 0.3, 2.0], 40), radius=0.7)


def through(directions, surfaces, origin, slack):
    """Return which rays pass through which patches, given some slack in metres, (targets, channels, steps) bool."""
    flat = np.hypot(directions[..., 0], directions[..., 1])
    ahead, slope = directions[..., :2] / flat[..., None], directions[..., 2] / flat
    heights = surfaces.low - slack - origin[2], surfaces.high + slack - origin[2]
    inside = []
    for place, low, high in zip(surfaces.xyz - origin, *heights, strict=True):
        along = ahead @ place[:2]
        squared = (surfaces.radius + slack) ** 2 - (place[:2] @ place[:2] - along**2)
        half = np.sqrt(np.maximum(squared, 0.0))
        begin, end = np.maximum(along - half, 0.0), np.where(squared < 0, -np.inf, along + half)
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = np.sort(np.stack([low / slope, high / slope]), axis=0)
        always = np.array([-np.inf, np.inf] if low <= 0.0 <= high else [np.inf, -np.inf])
        ends = np.where(slope == 0.0, always[:, None, None], ends)
        inside.append(np.minimum(end, ends[1]) - np.maximum(begin, ends[0]) >= -slack)
    return np.array(inside)


@pytest.mark.parametrize("seed", range(12))
def test_rays_near_a_target_are_those_through_its_patch(seed):
    random = np.random.default_rng(seed)
    origin, model, yaw = random.uniform(-5, 5, 3), draw_model(random), float(random.uniform(-3, 3))
    surfaces = draw_patches(random, origin)
    bundles = near_rays(model, origin, yaw, surfaces, np.ones(40, dtype=bool))
    found = np.zeros((40, model.channels, model.azimuth_count), dtype=bool)
    for target, channel, first, width in zip(
        bundles.target, bundles.channel, bundles.first, bundles.width, strict=True
    ):
        found[target, channel, (first + np.arange(width)) % model.azimuth_count] = True
    directions = beam_directions(model, yaw)
    surely, perhaps = (through(directions, surfaces, origin, slack) for slack in (-CLOSE, CLOSE))
    assert 10 < surely.sum() < found.size / 2
    assert (found | ~surely).all()
    perhaps[np.hypot(*(surfaces.xyz - origin)[:, :2].T) < surfaces.radius] = True  # from within, all azimuths are taken
    assert (perhaps | ~found).all()


def test_a_return_at_delta_sees_nothing():
    assert is_within(np.array([0.0, 0.999, 1.0, 1.001]), 1.0).tolist() == [True, True, False, False]


@each_engine
@pytest.mark.parametrize("shares", [(0.9, 0.05), (0.05, 0.9), (0.05, 0.05), (0.9, 0.9)])
def test_where_surfaces_lie_upon_each_other_the_weakest_decides(engine, shares):
    wall = np.array([[10.0, -9.0, 0.0], [10.0, 9.0, 0.0], [10.0, 0.0, 9.0]])
    caster = make_ray_caster(np.stack([wall, wall[[1, 2, 0]]]), engine)
    model = make_model(law=CarlaDropoff(attenuation=0.0, general=0.0))
    seen = VisibilityModel(
        np.array([[10.0, 0.0, 2.0]]), np.array(shares), VisibilitySettings(1.0, min_intensity=0.3), caster
    ).see(model, np.array([0.0, 0.0, 2.0]), np.eye(3))
    assert seen.tolist() == [min(shares) > 0.3]
