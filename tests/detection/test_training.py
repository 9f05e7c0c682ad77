"""Training: it learns, it is the same every time, and it can be stopped."""

import hashlib
from dataclasses import replace

from headless.detection.average_precision import evaluate
from headless.detection.detection_area import DetectionArea
from headless.detection.detector import Detector, TrainingRecord
from headless.detection.frames import Recording, SampledRecording, require_separate, sample_of
from headless.detection.inference import detect
from headless.detection.matching import Rule
from headless.detection.pillars import grid_over
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.detection.training import result_of_sample, train

import numpy as np
import pytest
import torch

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.geometry.height_raster import HeightRaster
from tests.builders.street_clouds import street_frame

SMALL = NetworkSettings(width=16, blocks=(1, 1, 1), most_points=8)
BRIEF = TrainingSettings(steps=6, batch=2, window=12.8, validate_every=3, threads=1)
GRID = grid_over((-16.0, -16.0, 16.0, 16.0), (-1.0, 4.5), SMALL.pillar)
AREA = DetectionArea(GRID, HeightRaster(np.full(2, -16.0), 32.0, np.zeros((2, 2))))


def sampled(name, traffic, frames, network=SMALL):
    return SampledRecording(Recording(name, traffic, len(frames), frames.__getitem__), AREA, network.most_points)


def recording(name, traffic, *seeds):
    return sampled(name, traffic, [street_frame(seed) for seed in seeds])


@pytest.fixture(scope="module")
def learning():
    return [recording("two sensors", "run 1", 1, 2), recording("the same again", "run 1", 3)]


@pytest.fixture(scope="module")
def aside():
    return [recording("validation", "run 2", 4)]


def trained(learning, aside, settings=BRIEF, network=SMALL, store=None):
    return finish(train(learning, aside, network, settings, store=store))


def bytes_of(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_a_frame_can_be_memorised():
    frame = street_frame(11, users=6, kinds=("car",))
    same, again = (sampled("frame", traffic, [frame]) for traffic in ("run 1", "run 1 by another name"))
    network = replace(SMALL, width=24)
    settings = replace(BRIEF, steps=300, batch=4, window=25.6, learning_rate=1e-2, validate_every=100)
    detector, curve = trained([same], [again], settings, network)
    found = result_of_sample(detector, AREA, sample_of(frame, AREA, network.most_points))
    assert evaluate([found], Rule(iou=0.7)).average_precision == pytest.approx(1.0)
    assert curve.loss[-1] < 0.3 * curve.loss[0]


def test_the_same_seed_gives_the_same_bytes(tmp_path, learning, aside):
    one, other = tmp_path / "one.pt", tmp_path / "other.pt"
    for path in (one, other):
        trained(learning, aside)[0].save(path)
    assert bytes_of(one) == bytes_of(other)
    trained(learning, aside, replace(BRIEF, seed=2))[0].save(other)
    assert bytes_of(one) != bytes_of(other)


def test_a_training_that_was_stopped_goes_on_as_if_it_had_not_been(tmp_path, learning, aside):
    whole, broken = tmp_path / "whole.pt", tmp_path / "broken.pt"
    trained(learning, aside, store=whole)
    steps = train(learning, aside, SMALL, BRIEF, store=broken)
    for progress in steps:
        if progress.done == 4:
            break
    steps.close()
    assert broken.exists()
    resumed = list(train(learning, aside, SMALL, BRIEF, store=broken))
    assert resumed[0].done == 3
    assert bytes_of(whole) == bytes_of(broken)
    assert len(list(train(learning, aside, SMALL, BRIEF, store=broken))) == 1  # nothing left to do


def test_runs_of_traffic_are_in_one_split_alone(learning, aside):
    splits = {"training": learning, "validation": aside, "test": [recording("leak", "run 1", 7)]}
    recordings = {what: [each.recording for each in some] for what, some in splits.items()}
    with pytest.raises(SeipError, match=r"two sensors \(training\) and leak \(test\) show the same run of traffic"):
        require_separate(recordings)
    with pytest.raises(SeipError, match="same run of traffic"):
        next(train(learning, learning, SMALL, BRIEF))


def test_a_training_goes_on_from_another_detector(learning, aside, tmp_path):
    record = TrainingRecord(("type9",), ("Elsewhere",))
    start = Detector(SMALL, seed=9, training_record=record)
    once = replace(BRIEF, steps=1, learning_rate=1e-12)
    begun = finish(train(learning, aside, SMALL, once, start=start, store=tmp_path / "begun.pt"))[0]
    weights = begun.state_dict()
    for name, value in start.named_parameters():
        torch.testing.assert_close(weights[name], value, atol=1e-9, rtol=1e-6)
    assert set(record.sites) <= set(begun.training_record.sites)
    assert set(record.sensors) <= set(begun.training_record.sensors)
    with pytest.raises(SeipError, match="other settings or recordings"):
        next(train(learning, aside, SMALL, once, store=tmp_path / "begun.pt"))


def test_a_detector_is_read_back_as_it_was(tmp_path, learning, aside):
    detector = trained(learning, aside, replace(BRIEF, steps=1))[0]
    path = tmp_path / "detector.pt"
    detector.save(path)
    again = Detector.load(path)
    frame = street_frame(6)
    one, other = (detect(d, AREA, frame, least_score=0.0) for d in (detector, again))
    np.testing.assert_array_equal(one.boxes, other.boxes)
    assert again.settings == SMALL


@pytest.mark.parametrize("content", [b"", b"PK nothing"])
def test_what_is_no_detector_is_refused(tmp_path, content):
    path = tmp_path / "detector.pt"
    path.write_bytes(content)
    with pytest.raises(SeipError, match="is not a detector file, or is damaged"):
        Detector.load(path)
    torch.save({"schema": "seip.detector", "version": 99}, path)
    with pytest.raises(SeipError, match="not a detector of this version"):
        Detector.load(path)
    with pytest.raises(SeipError, match=r"missing\.pt cannot be read"):
        Detector.load(tmp_path / "missing.pt")


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"most_points": 64}, "1 to 32 points"),
        ({"pillar": 0.0}, "0.05 to 2 m"),
        ({"blocks": (1, 1)}, "three blocks"),
    ],
)
def test_impossible_settings_are_refused(wrong, sentence):
    with pytest.raises(SeipError, match=sentence):
        NetworkSettings(**wrong)
