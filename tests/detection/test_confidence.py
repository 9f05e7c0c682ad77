"""Confidence of detections: the map from scores to shares of true boxes, its file, and its fit."""

import json
import math
import shutil

import numpy as np
import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")
pytest.importorskip("bpy")

from headless.detection.confidence import SUFFIX, Confidence
from headless.detection.detector import SHIPPED_DETECTOR, Detector
from headless.detection.frame_results import EvaluatedBoxes, FrameResult
from headless.detection.settings import CLASS_CATEGORIES, CLASSES
from headless.studies.fit_confidence import calibration_error, fitted

from seip_addon.core.base.errors import SeipError

CATEGORIES = [category for group in CLASS_CATEGORIES.values() for category in group]


@pytest.fixture(scope="module")
def detector():
    return Detector.load(SHIPPED_DETECTOR)


def frame(score, category):
    """Return a frame with detections of which only score and category matter."""
    none = np.zeros(len(score))
    boxes = EvaluatedBoxes(np.zeros((len(score), 7)), score, np.array(category), none, none, none > 0, none)
    return FrameResult("run", 0.0, None, boxes)


@pytest.fixture
def copied(tmp_path):
    """The shipped file next to a detector's, and its content."""
    path = tmp_path / f"shipped{SUFFIX}"
    shutil.copy(SHIPPED_DETECTOR.with_suffix(SUFFIX), path)
    return path, json.loads(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("category", CATEGORIES)
def test_confidence_is_the_increasing_map_of_the_class_in_the_file(detector, copied, category):
    path, content = copied
    known = Confidence.of_detector(path.with_name("shipped.pt"), detector)
    (name,) = (name for name, group in CLASS_CATEGORIES.items() if category in group)
    slope, offset = content["maps"][name]
    score = np.linspace(0, 1, 201)
    sure = known.applied(frame(score, [category] * len(score))).detected.score
    by_hand = [1 / (1 + math.exp(-offset - slope * math.log(one / (1 - one)))) for one in score[1:-1]]
    assert sure == pytest.approx([0.0, *by_hand, 1.0], rel=1e-12)
    assert (np.diff(sure) > 0).all()


def test_without_a_file_confidence_is_the_score(tmp_path, detector):
    known = Confidence.of_detector(tmp_path / "detector.pt", detector)
    result = frame(np.array([0.0, 0.05, 0.5, 1.0]), ["bus", "car", "van", "bicycle"])
    assert known.applied(result).detected.score == pytest.approx(result.detected.score, rel=1e-12)
    assert known.recordings == ()


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"schema": "seip-confidence/2"}, "has the schema 'seip-confidence/2', not 'seip-confidence/1'"),
        ({"detector": "0" * 64}, "belongs to another detector"),
        ({"maps": [1, 2]}, "maps must be an object"),
        ({"maps": {"car": [2.0, 0.0]}}, "needs a positive slope for each of car, truck"),
        ({"maps": dict.fromkeys(CLASSES, (-1.0, 0.0))}, "needs a positive slope"),
        ({"maps": dict.fromkeys(CLASSES, ("steep", 0.0))}, "maps.car.* must be a number"),
    ],
)
def test_files_of_other_versions_and_detectors_are_refused(detector, copied, change, sentence):
    path, content = copied
    path.write_text(json.dumps(content | change), encoding="utf-8")
    with pytest.raises(SeipError, match=sentence):
        Confidence.of_detector(path.with_name("shipped.pt"), detector)


def test_the_fit_recovers_a_map_and_removes_the_calibration_error():
    random = np.random.default_rng(5)
    score, category = random.uniform(0.05, 0.95, 40_000), random.integers(0, len(CLASSES), 40_000)
    drawn = Confidence("", {name: (2.0 + number, -0.5 * number) for number, name in enumerate(CLASSES)})
    true = random.uniform(size=len(score)) < np.choose(category, [drawn.of_class(name, score) for name in CLASSES])
    halves = [("site", category[half::2], score[half::2], true[half::2]) for half in (0, 1)]
    known = Confidence("", fitted(halves))
    for name in CLASSES:
        assert known.maps[name] == pytest.approx(drawn.maps[name], abs=0.25)
    found = np.choose(category, [known.of_class(name, score) for name in CLASSES])
    assert calibration_error(found, true) < 0.01
    assert calibration_error(score, true) > 0.1
