"""Gain of a unit from the share of its rays that return."""

from dataclasses import replace

import numpy as np
import pytest

from seip_addon.core.sensing.recordings.comparison import AGREES, NOTHING, compare_rays
from seip_addon.core.sensing.recordings.unit_gain import fitted_gain
from tests.builders.scanned_street import ground_mesh, mounted, street_background, street_meshes, surface_of
from tests.few import few

PLANNED = mounted("os1_64_rev7")
MESHES = (ground_mesh(), *street_meshes())


@pytest.fixture(scope="module")
def surface():
    return surface_of(MESHES)


def compared(surface, gain, seed=0, **how):
    """Each seed has surfaces of its own, which deviate from their materials."""
    real = replace(PLANNED, model=PLANNED.model.amplified(gain))
    return compare_rays(surface, PLANNED, street_background(surface, real, seed=seed, **how))


@pytest.mark.parametrize("gain", few([0.5, 2.0, 0.3, 1.0], 2))
def test_the_gain_of_a_unit_is_found(surface, gain):
    found = [fitted_gain(compared(surface, gain, seed=seed, sweeps=15)) for seed in range(4)]
    assert np.mean([np.log(one.value) for one in found]) == pytest.approx(np.log(gain), abs=0.12)
    assert all(one.low < one.value < one.high < 2.5 * one.low for one in found)
    assert sum(one.low <= gain <= one.high for one in found) >= 3


@pytest.mark.slow
@pytest.mark.parametrize("gain", [0.5, 1.0])
def test_the_interval_covers_the_gain_in_95_percent_of_draws(surface, gain):
    found = [fitted_gain(compared(surface, gain, seed=seed, sweeps=30)) for seed in range(20)]
    assert sum(one.low <= gain <= one.high for one in found) >= 17  # 16 or fewer of 20 have a probability of 1.6 %


def test_a_recording_without_losses_has_no_gain(surface):
    one = compared(surface, 1.0)
    assert fitted_gain(replace(one, returned=np.ones_like(one.returned))) is None
    assert (
        fitted_gain(replace(one, result=np.full_like(one.result, NOTHING), returned=np.zeros_like(one.returned)))
        is None
    )
    few = one.result.copy()
    few[np.flatnonzero(np.isin(few, (AGREES, NOTHING)))[400:]] = -1
    assert fitted_gain(replace(one, result=few)) is None
