"""Patches of surfaces: normal, the same wherever rounding puts a hit, and alike nearby."""

import numpy as np
import pytest

from seip_addon.core.sensing.lidar.surface_patches import PATCH_SIZES, PATCH_VARIANCES, surface_deviation

STEPS = np.arange(0.0, 800.0, 1.9437)  # in step with no patches
SQUARE = np.stack(np.meshgrid(STEPS, STEPS, [0.0]), -1).reshape(-1, 3)


def test_deviation_is_standard_normal():
    assert sum(PATCH_VARIANCES) == pytest.approx(1.0)
    deviation = surface_deviation(SQUARE, (3, 0))
    assert (deviation.mean(), deviation.std()) == (pytest.approx(0.0, abs=0.05), pytest.approx(1.0, abs=0.05))
    assert (deviation > 1.645).mean() == pytest.approx(0.05, abs=0.01)


def test_a_seed_is_a_surface_of_its_own():
    first, again, other = (surface_deviation(SQUARE, seed) for seed in ((1, 0), (1, 0), (1, 1)))
    assert np.array_equal(first, again)
    assert abs(np.corrcoef(first, other)[0, 1]) < 0.05


@pytest.mark.parametrize("level", [0.0, 1.0, -16.0, 0.15])
def test_rounding_of_round_coordinates_changes_nothing(level):
    at = SQUARE + np.array((0.0, 0.0, level))
    exact = surface_deviation(at, (3, 0))
    for rounding in (-1e-9, 1e-9):
        assert np.array_equal(surface_deviation(at + rounding, (3, 0)), exact)


def test_neighbours_deviate_alike_and_distant_places_do_not():
    deviation = surface_deviation(SQUARE, (3, 0))

    def alike(shift: float) -> float:
        return float(np.corrcoef(deviation, surface_deviation(SQUARE + np.array((shift, 0.0, 0.0)), (3, 0)))[0, 1])

    for shift in (0.2, 1.0, 4.0):  # the share of places whose shifted place lies in the same cube
        expected = sum(
            share * max(0.0, 1.0 - shift / size) for size, share in zip(PATCH_SIZES, PATCH_VARIANCES, strict=True)
        )
        assert alike(shift) == pytest.approx(expected, abs=0.06)
    assert abs(alike(2 * max(PATCH_SIZES))) < 0.06
