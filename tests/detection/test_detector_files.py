"""What a detector's file holds is checked once, where it is read."""

from headless.detection.detector import Detector, TrainingRecord, save_state, suitability_warnings
from headless.detection.settings import NetworkSettings

import pytest
import torch

from seip_addon.core.base.errors import SeipError

NETWORK = NetworkSettings(width=8, blocks=(0, 0, 0), most_points=2)


@pytest.fixture
def stored(tmp_path):
    path = tmp_path / "detector.pt"
    Detector(NETWORK, seed=1, training_record=TrainingRecord(("type1",), ("Junction",))).save(path)
    return path


def written(path, change):
    """Change a file's content."""
    state = torch.load(path, weights_only=True)
    change(state)
    save_state(path, state)
    return path


def _set(table, name, value):
    def change(state):
        state[table][name] = value

    return change


CHANGES = {
    "a width out of range": (_set("settings", "width", 10**6), "width must lie between"),
    "a setting that nobody knows": (_set("settings", "depth", 3), "damaged"),
    "other weights": (_set("settings", "width", 16), "damaged"),
}


@pytest.mark.parametrize(("change", "sentence"), CHANGES.values(), ids=CHANGES)
def test_detectors_that_make_no_sense_are_refused(stored, change, sentence):
    with pytest.raises(SeipError, match="train it again") as refusal:
        Detector.load(written(stored, change))
    assert sentence in str(refusal.value)
    assert "\n" not in str(refusal.value)


KNOWN = TrainingRecord(("type1", "type2"), ("Junction",))


def detector(training_record=KNOWN):
    return Detector(NETWORK, seed=1, training_record=training_record)


def test_it_is_quiet_at_home():
    assert suitability_warnings(detector(), ["type1", "type1"], "Junction") == ()


def test_other_sensor_types_are_named():
    (sentence,) = suitability_warnings(detector(), ["type3", "type1"], "Junction")
    assert "trained on clouds of type1 and type2, not of type3:" in sentence
