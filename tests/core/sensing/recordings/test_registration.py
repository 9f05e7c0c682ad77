"""Poses fitted to recordings of a street whose true pose is known."""

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.recordings.registration import register
from tests.builders.scanned_street import (
    box_mesh,
    ground_mesh,
    mounted,
    moved,
    street_background,
    street_meshes,
    surface_of,
)
from tests.few import few

PLANNED = mounted()


@pytest.fixture(scope="module")
def surface():
    return surface_of((ground_mesh(), *street_meshes()))


def fitted(surface, seed, *, real=None, **how):
    """Return a registration of the street and the true shift."""
    true, shift = moved(PLANNED, np.random.default_rng(seed))
    return register(surface, PLANNED, street_background(real or surface, true, seed=seed, **how)), true, shift


@pytest.mark.parametrize("seed", few(range(3), 1))
@pytest.mark.parametrize("vehicles", [0, 6])
def test_the_pose_is_found(surface, seed, vehicles):
    found, true, shift = fitted(surface, seed, vehicles=vehicles)
    assert np.abs(found.shift - shift)[:3].max() < 0.001
    assert np.abs(found.shift - shift)[3:].max() < 0.0001
    assert np.abs(found.sensor.xyz - true.xyz).max() < 0.001
    assert np.abs(found.sensor.orientation - true.orientation).max() < 0.0001
    assert np.allclose(found.sensor.orientation @ found.sensor.orientation.T, np.eye(3), atol=1e-12)
    assert found.match > 0.95


def test_what_has_changed_does_not_move_the_pose(surface):
    _, north_west, *rest = street_meshes()
    new = (box_mesh("kiosk", 6, 13, 4, 3, 3), box_mesh("hoarding", -3, -16, 8, 0.2, 2.5, 0.2))
    changed = surface_of((ground_mesh(), north_west, *rest, *new))
    found, _, shift = fitted(surface, 1, real=changed)
    assert np.abs(found.shift - shift)[:3].max() < 0.005
    assert np.abs(found.shift - shift)[3:].max() < 0.0003


def test_another_site_is_refused(surface):
    other = surface_of(
        (ground_mesh(-0.03), box_mesh("left", -15, 0, 4, 60, 12, 0.5), box_mesh("right", 6, 0, 4, 60, 8, 0.45))
    )
    with pytest.raises(SeipError, match=r"of the rays of S1 agree with the scene: this is the recording of another"):
        fitted(surface, 0, real=other)


@pytest.mark.slow
def test_intervals_cover_the_true_pose_in_95_percent_of_draws(surface):
    results = [fitted(surface, seed, vehicles=4) for seed in range(40)]
    inside = np.array([np.abs(found.shift - shift) <= found.half_width for found, _, shift in results])
    # 40 draws of 95 %: fewer than 34 have a probability of 1.4 % for one component
    assert (inside.sum(axis=0) >= 34).all()
    assert inside.mean() >= 0.92
    assert max(found.half_width[:3].max() for found, _, _ in results) < 0.001
