"""A detector says what it has been trained on, and what speaks against using it beyond."""

from headless.detection.detection_area import DetectionArea
from headless.detection.detector import Detector, TrainingRecord
from headless.detection.pillars import filling, grid_over
from headless.detection.settings import NetworkSettings
from headless.detection.suitability import MAX_OVERFULL_SHARE, suitability_warnings

import numpy as np
import pytest

from seip_addon.core.geometry.height_raster import HeightRaster
from tests.builders.street_clouds import cloud_frame

NETWORK = NetworkSettings(width=8, blocks=(0, 0, 0), most_points=2)
GRID = grid_over((0.0, 0.0, 16.0, 16.0), (0.0, 4.0), NETWORK.pillar)
KNOWN = TrainingRecord(("type1", "type2"), ("Junction",))
AREA = DetectionArea(GRID, HeightRaster(np.zeros(2), 16.0, np.zeros((2, 2))))
NOTHING = np.zeros((0, 4), dtype=np.float32)


def detector(training_record=KNOWN):
    return Detector(NETWORK, seed=1, training_record=training_record)


def heaps(*sizes):
    """Points in pillars of their own, so many in each."""
    return np.array(
        [[0.2 + 0.4 * column, 0.2, 1.0 + 0.01 * n, 0.5] for column, size in enumerate(sizes) for n in range(size)],
        dtype=np.float32,
    )


def test_it_is_quiet_at_home():
    assert suitability_warnings(detector(), ["type1", "type1"], AREA, cloud_frame(heaps(1, 2, 2))) == ()


def test_other_sensor_types_are_named():
    (sentence,) = suitability_warnings(detector(), ["type3", "type1"], AREA, cloud_frame(NOTHING))
    assert "trained on clouds of type1 and type2, not of type3:" in sentence


def test_over_full_pillars_are_counted():
    full = filling(heaps(1, 2, 5), GRID, 2)
    assert full.empty == pytest.approx(1 - 3 / len(GRID))
    assert full.over_full == pytest.approx(1 / 3)
    assert full.left_out == pytest.approx(3 / 8)
    assert filling(NOTHING, GRID, 2).empty == 1.0
    crowded = heaps(5, 5, 5, 1)
    assert filling(crowded, GRID, 2).over_full > MAX_OVERFULL_SHARE
    (sentence,) = suitability_warnings(detector(), ["type1"], AREA, cloud_frame(crowded))
    assert sentence.startswith("75% of the pillars with points have more than the 2 that are kept, and 56% of all")
