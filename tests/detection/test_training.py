"""Training: it learns, it is the same every time, and it can be stopped."""

import hashlib
from dataclasses import replace

from headless.detection.average_precision import evaluate
from headless.detection.detection_area import DetectionArea
from headless.detection.detector import Detector, TrainingRecord
from headless.detection.frames import LazyFrames, Recording, SampledRecording, require_separate, sample_of, spread
from headless.detection.inference import detect, detect_on_level
from headless.detection.matching import Rule
from headless.detection.pillars import fill_pillars, grid_over
from headless.detection.settings import CLASSES, NetworkSettings, TrainingSettings
from headless.detection.training import deterministic, result_of_sample, train, vary

import numpy as np
import pytest
import torch

from seip_addon.core.errors import SeipError
from seip_addon.core.geometry.height_raster import HeightRaster
from seip_addon.core.progress import finish
from seip_addon.core.sensing.scans.frame import Frame
from tests.builders.street_clouds import street_frame

SMALL = NetworkSettings(width=16, blocks=(1, 1, 1), most_points=8)
BRIEF = TrainingSettings(steps=6, batch=2, window=12.8, validate_every=3, threads=1)
GRID = grid_over((-16.0, -16.0, 16.0, 16.0), (-1.0, 4.5), SMALL.pillar)
AREA = DetectionArea(GRID, HeightRaster(np.full(2, -16.0), 32.0, np.zeros((2, 2))))


def sampled(name, traffic, frames, network=SMALL):
    return SampledRecording(Recording(name, traffic, frames), AREA, network.most_points)


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
    result = trained([same], [again], settings, network)
    found = result_of_sample(result.detector, AREA, sample_of(frame, AREA, network.most_points))
    assert evaluate([found], Rule(iou=0.7)).average_precision == pytest.approx(1.0)
    assert result.curve.loss[-1] < 0.3 * result.curve.loss[0]


def test_the_same_seed_gives_the_same_bytes(tmp_path, learning, aside):
    one, other = tmp_path / "one.pt", tmp_path / "other.pt"
    for path in (one, other):
        trained(learning, aside).detector.save(path)
    assert bytes_of(one) == bytes_of(other)
    trained(learning, aside, replace(BRIEF, seed=2)).detector.save(other)
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


def test_another_training_is_not_continued(tmp_path, learning, aside):
    path = tmp_path / "state.pt"
    trained(learning, aside, store=path)
    with pytest.raises(SeipError, match="other settings or recordings"):
        trained(learning, aside, replace(BRIEF, seed=9), store=path)
    with pytest.raises(SeipError, match="or recordings"):
        trained(learning[:1], aside, store=path)


def test_a_training_of_another_version_is_not_continued(tmp_path, learning, aside, monkeypatch):
    path = tmp_path / "state.pt"
    trained(learning, aside, store=path)
    monkeypatch.setattr("headless.detection.training.source_digest", lambda module: f"other {module}")
    with pytest.raises(SeipError, match="another version of the program"):
        trained(learning, aside, store=path)


def test_training_ends_when_it_no_longer_helps(learning, aside):
    settings = replace(BRIEF, steps=40, learning_rate=1e-9, validate_every=1, patience=3)
    result = trained(learning, aside, settings)
    assert max(result.curve.validation) == 4
    assert result.curve.best == 1


def test_training_leaves_torch_as_it_was(learning, aside):
    before = torch.get_num_threads(), torch.are_deterministic_algorithms_enabled(), torch.random.get_rng_state()
    for _ in train(learning, aside, SMALL, replace(BRIEF, steps=1)):
        assert not torch.are_deterministic_algorithms_enabled()
    assert (torch.get_num_threads(), torch.are_deterministic_algorithms_enabled()) == before[:2]
    assert (torch.random.get_rng_state() == before[2]).all()


def test_whoever_leaves_last_puts_torch_back():
    """A thread that goes on after its work was given up must not leave torch as others had set it."""
    before = torch.get_num_threads(), torch.are_deterministic_algorithms_enabled()
    outer, late = deterministic(1), deterministic(1)
    outer.__enter__()
    late.__enter__()
    outer.__exit__(None, None, None)
    assert torch.are_deterministic_algorithms_enabled()
    late.__exit__(None, None, None)
    assert (torch.get_num_threads(), torch.are_deterministic_algorithms_enabled()) == before
    assert torch.utils.deterministic.fill_uninitialized_memory


def test_runs_of_traffic_are_in_one_split_alone(learning, aside):
    splits = {"training": learning, "validation": aside, "test": [recording("leak", "run 1", 7)]}
    recordings = {what: [each.recording for each in some] for what, some in splits.items()}
    with pytest.raises(SeipError, match=r"two sensors \(training\) and leak \(test\) show the same run of traffic"):
        require_separate(recordings)
    with pytest.raises(SeipError, match="same run of traffic"):
        next(train(learning, learning, SMALL, BRIEF))


def test_there_must_be_something_to_learn_from(aside):
    with pytest.raises(SeipError, match="no frame to learn from"):
        next(train([sampled("empty", "run 1", [])], aside, SMALL, BRIEF))


def test_frames_without_road_users_and_without_points_are_trained_on_too(aside):
    empty = street_frame(5, users=0)
    blind = replace(
        empty, **{name: getattr(empty, name)[:0] for name in ("points", "intensity", "instance", "foreground")}
    )
    blind = replace(blind, sensor=blind.sensor[:0], delay=blind.delay[:0])
    assert len(empty.labels) == 0
    result = trained([sampled("quiet", "run 1", [empty, blind])], aside)
    assert all(np.isfinite(result.curve.loss))


def test_a_training_goes_on_from_another_detector(learning, aside, tmp_path):
    record = TrainingRecord(("type9",), ("Elsewhere",))
    start = Detector(SMALL, seed=9, training_record=record)
    once = replace(BRIEF, steps=1, learning_rate=1e-12)
    begun = finish(train(learning, aside, SMALL, once, start=start, store=tmp_path / "begun.pt")).detector
    weights = begun.state_dict()
    for name, value in start.named_parameters():
        torch.testing.assert_close(weights[name], value, atol=1e-9, rtol=1e-6)
    assert set(record.sites) <= set(begun.training_record.sites)
    assert set(record.sensors) <= set(begun.training_record.sensors)
    with pytest.raises(SeipError, match="other settings or recordings"):
        next(train(learning, aside, SMALL, once, store=tmp_path / "begun.pt"))


def test_an_empty_cloud_has_nobody_in_it():
    detector = Detector(SMALL, seed=1)
    found = detect_on_level(detector, GRID, np.zeros((0, 4), dtype=np.float32), least_score=0.5)
    assert len(found) == 0
    assert found.boxes.shape == (0, 7)


def test_detections_do_not_depend_on_the_order_of_points(learning, aside):
    detector = trained(learning, aside).detector
    frame = street_frame(6)
    order = np.random.default_rng(0).permutation(len(frame))
    one = detect(detector, AREA, frame, least_score=0.0)
    shuffled = {name: getattr(frame, name)[order] for name in ("points", "intensity", "foreground")}
    other = detect(detector, AREA, replace(frame, **shuffled), least_score=0.0)
    assert len(one) > 0
    np.testing.assert_array_equal(one.boxes, other.boxes)
    np.testing.assert_array_equal(one.score, other.score)
    assert one.category.max() < len(CLASSES)


def test_samples_lose_nothing_that_a_detector_would_see(learning, aside):
    detector = trained(learning, aside).detector
    frame = street_frame(6)
    sample = sample_of(frame, AREA, SMALL.most_points)
    assert len(sample.points) < len(frame)
    whole = fill_pillars(AREA.cloud(frame), GRID, SMALL.most_points)
    thinned = fill_pillars(sample.points, GRID, SMALL.most_points)
    np.testing.assert_array_equal(whole.features, thinned.features)
    one = detect(detector, AREA, frame, least_score=0.0)
    other = detect_on_level(detector, GRID, sample.points, least_score=0.0)
    np.testing.assert_array_equal(one.boxes, other.boxes)


def test_windows_keep_points_on_their_road_users():
    frame = street_frame(12, users=8)
    sample = sample_of(frame, AREA, 32)
    window = GRID.window(*GRID.centre, 48)
    for seed in range(20):
        varied = vary(sample, window, np.random.default_rng(seed))
        assert len(varied.boxes)
        for box, returns in zip(varied.boxes, varied.returns, strict=True):
            if np.abs(box[:2]).max() + box[3] / 2 > 9.6 or returns < 100:
                continue
            here = varied.points[:, :3] - box[:3]
            ahead = here[:, 0] * np.cos(box[6]) + here[:, 1] * np.sin(box[6])
            aside_ = here[:, 1] * np.cos(box[6]) - here[:, 0] * np.sin(box[6])
            inside = (np.abs(ahead) < box[3] / 2 + 0.06) & (np.abs(aside_) < box[4] / 2 + 0.06)
            inside &= np.abs(here[:, 2]) < box[5] / 2 + 0.06
            front = inside & (ahead > 0.25 * box[3]) & (here[:, 2] > 0.2 * box[5])
            back = inside & (ahead < -0.25 * box[3]) & (here[:, 2] > 0.2 * box[5])
            assert inside.sum() > 30
            assert front.sum() < back.sum()  # the front is low, whichever way it was turned


def test_a_detector_is_read_back_as_it_was(tmp_path, learning, aside):
    detector = trained(learning, aside).detector
    path = tmp_path / "detector.pt"
    detector.save(path)
    again = Detector.load(path)
    frame = street_frame(6)
    one, other = (detect(d, AREA, frame, least_score=0.0) for d in (detector, again))
    np.testing.assert_array_equal(one.boxes, other.boxes)
    assert again.settings == SMALL


@pytest.mark.parametrize("content", [b"", b"PK nothing", b"\x80\x02."])
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


def test_frames_in_files_are_read_when_they_are_asked_for(tmp_path):
    paths = [tmp_path / f"{number}.npz" for number in range(3)]
    for number, path in enumerate(paths):
        street_frame(number, users=2, rays=500, time=float(number)).save(path)
    files = LazyFrames(3, lambda number: Frame.load(paths[number]))
    paths[0].unlink()
    assert [files[number].time for number in (1, 2)] == [1.0, 2.0]
    assert isinstance(files[1], Frame)
    recorded = sampled("files", "run 1", LazyFrames(2, lambda number: files[number + 1]))
    assert len(spread([recorded], 1)) == 1
    assert recorded.get(1) is recorded.get(1)
