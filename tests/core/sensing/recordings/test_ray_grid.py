"""Rays recovered from points: every spinning sensor of the catalogue, and clouds that have no rays."""

import math

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.recordings.ray_grid import RayGrid, recovered_rays
from tests.builders.street_recording import canyon_sweeps
from tests.few import few

CATALOGUE = load_catalogue()
SPINNING = sorted(CATALOGUE.keys() - {"mid40", "mid70"})  # whose scans do not repeat
SOME = ("vlp16", "os1_128", "ruby_plus", "at128", "mid360")
RARE = 0.05  # share of the returns of the median ring, below which a ring cannot be told from stray points
TOO_FINE = {"type2"}
"""Generic sensors with steps of 0.048°, which half precision at 50 m from the origin rounds away."""


def require_recovered(key, sweeps, hit):
    """The grid has the rings, steps and phases of the model, as far as the model's rays met anything."""
    model = CATALOGUE[key]
    grid = recovered_rays(sweeps, model, "the recording")
    returns = hit.sum(axis=1)
    usual = returns > RARE * np.median(returns[returns > 0])
    expected = np.sort(model.elevations[usual])
    assert math.tau / model.azimuth_step == pytest.approx(grid.steps, abs=0.5)
    near = np.abs(expected[:, None] - grid.elevation)
    assert near.min(axis=1).max() < math.radians(0.03)
    assert len(set(near.argmin(axis=1).tolist())) == len(expected)
    assert len(expected) <= len(grid.elevation) <= (returns > 0).sum()
    if model.all_round:
        ring = np.abs(model.elevations[usual, None] - grid.elevation).argmin(axis=1)
        phase = (model.azimuth_offsets[usual] - grid.phase[ring]) / model.azimuth_step
        assert np.abs(phase - np.round(phase)).max() < 0.1
    return grid


@pytest.mark.parametrize("key", few(SOME, 2))
def test_rays_are_those_of_the_model(key):
    require_recovered(key, *canyon_sweeps(CATALOGUE[key]))


@pytest.mark.parametrize("key", few(SOME, 2))
@pytest.mark.parametrize("how", [{"jitter": 0.2}, {"half_at": 50.0}, {"twice": True}])
def test_rays_survive_jitter_rounding_and_second_returns(key, how):
    require_recovered(key, *canyon_sweeps(CATALOGUE[key], **how))


@pytest.mark.slow
@pytest.mark.parametrize("key", SPINNING)
@pytest.mark.parametrize("how", [{}, {"jitter": 0.1}, {"jitter": 0.2}, {"half_at": 50.0}])
def test_rays_of_every_spinning_sensor_of_the_catalogue_are_recovered(key, how):
    if key in TOO_FINE and "half_at" in how:
        pytest.skip("its steps are finer than the rounding")
    require_recovered(key, *canyon_sweeps(CATALOGUE[key], count=10, **how))


def test_many_revolutions_in_one_sweep_are_refused():
    model = CATALOGUE["vlp16"]
    azimuth = np.random.default_rng(0).uniform(-math.pi, math.pi, (len(model.elevations), 120_000))
    elevation = np.broadcast_to(model.elevations[:, None], azimuth.shape)
    level = 20.0 * np.cos(elevation)
    points = np.stack((level * np.cos(azimuth), level * np.sin(azimuth), 20.0 * np.sin(elevation)), axis=-1)
    with pytest.raises(SeipError, match="as many revolutions in one sweep have"):
        recovered_rays([points.reshape(-1, 3).astype(np.float32)], model, "the recording")


@pytest.mark.parametrize("key", few(SOME, 2))
def test_each_point_belongs_to_its_ray_and_each_ray_has_its_nearest_range(key):
    model = CATALOGUE[key]
    sweeps, hit = canyon_sweeps(model)
    grid = require_recovered(key, sweeps, hit)
    rays = grid.rays(sweeps[0])
    directions = grid.directions()[rays]
    distance = np.linalg.norm(sweeps[0].astype(np.float64), axis=1)
    off = np.linalg.norm(sweeps[0] / distance[:, None] - directions, axis=1)
    assert np.quantile(off, 0.999) < 0.2 * model.azimuth_step + math.radians(0.02)
    ranges = grid.ranges(np.concatenate([sweeps[0], 2 * sweeps[0], 1.5 * sweeps[0]]))
    assert np.isinf(np.delete(ranges, rays)).all()
    nearest = np.full(len(grid), np.inf)
    for ray, own in zip(rays.tolist(), distance.tolist(), strict=True):
        nearest[ray] = min(nearest[ray], own)
    assert np.allclose(ranges[rays], nearest[rays], rtol=1e-6)


def test_directions_and_rays_are_inverse():
    random = np.random.default_rng(0)
    grid = RayGrid(np.sort(random.uniform(-0.5, 0.5, 20)), random.uniform(-math.pi, math.pi, 20), 300)
    points = (grid.directions() * random.uniform(1, 100, (len(grid), 1))).astype(np.float32)
    assert (grid.rays(points) == np.arange(len(grid))).all()


@pytest.mark.parametrize(
    ("made_by", "named"),
    [
        ("os1_128", "vlp16"),
        ("os1_128", "os1_64_rev7"),
        ("vlp16", "bpearl"),
        ("os0_128", "os1_128"),
        ("vlp32c", "vlp16"),
    ],
)
def test_the_recording_of_another_sensor_is_refused(made_by, named):
    sweeps, _ = canyon_sweeps(CATALOGUE[made_by])
    with pytest.raises(SeipError, match="name the sensor that made"):
        recovered_rays(sweeps, CATALOGUE[named], "the recording")
