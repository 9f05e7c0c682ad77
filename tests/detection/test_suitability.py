"""A detector says what it has been trained on, and what speaks against using it beyond."""

from headless.detection.detector import Detector, TrainingRecord, suitability_warnings
from headless.detection.settings import NetworkSettings

NETWORK = NetworkSettings(width=8, blocks=(0, 0, 0), most_points=2)
KNOWN = TrainingRecord(("type1", "type2"), ("Junction",))


def detector(training_record=KNOWN):
    return Detector(NETWORK, seed=1, training_record=training_record)


def test_it_is_quiet_at_home():
    assert suitability_warnings(detector(), ["type1", "type1"], "Junction") == ()


def test_other_sensor_types_are_named():
    (sentence,) = suitability_warnings(detector(), ["type3", "type1"], "Junction")
    assert "trained on clouds of type1 and type2, not of type3:" in sentence
