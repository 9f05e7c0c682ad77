"""The study from detectors and traffic to rows and charts: small, but whole."""

from dataclasses import replace
from types import SimpleNamespace

from headless.detection.detector import Detector
from headless.detection.recordings import SampledRun, Simulator
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.studies.detector_limits import study as study_module
from headless.studies.detector_limits import trials as trials_module
from headless.studies.detector_limits.charts import save_limits_chart, save_transfer_chart
from headless.studies.detector_limits.disturbances import Disturbance, DropOff, SensorFailure, YawError
from headless.studies.detector_limits.rows import format_points, limit_rows
from headless.studies.detector_limits.study import (
    DisturbanceCurve,
    DisturbanceEffect,
    EvaluatedDetectors,
    OtherSite,
    limits_study,
    training_plan,
)
from headless.studies.detector_limits.trials import EvaluatedDetector, TrialSite, trials

import numpy as np
import pytest
from matplotlib.image import imread

from seip_addon.core.estimates import IntervalEstimate
from seip_addon.core.progress import finish
from seip_addon.core.sensing.scans.simulation import ScanSettings
from tests.builders.square_by_hand import road, sensors

NETWORK = NetworkSettings(width=8, blocks=(0, 0, 0))


class Hung:
    """What a configuration is to a trial."""

    def __init__(self):
        self.name, self.sensor, self.sensors = "2 × type1", "type1", sensors()
        self.places = np.array([sensor.xyz for sensor in self.sensors])


def ground(name="home", seed=3):
    geometry, trajectories = road()
    run = SampledRun("run", trajectories, np.array([1.0, 1.5]))
    return TrialSite(name, Simulator(geometry, ScanSettings(seed=seed)), (run,))


def one_tested(seed, network=NETWORK):
    return EvaluatedDetector(f"detector-{seed}", Detector(network, seed))


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return tmp_path_factory.mktemp("trials")


@pytest.fixture(scope="module")
def asked(store):
    two = (one_tested(1), one_tested(2))
    padded = (one_tested(3, replace(NETWORK, padded=True)),)
    by_type = {"type1": one_tested(5), "type2": one_tested(6)}
    candidates = EvaluatedDetectors(two, by_type, (one_tested(8),), padded, two[:1])
    away, denser = (OtherSite(ground(name, seed=seed), (Hung(),)) for name, seed in (("away", 4), ("denser", 5)))
    return ground(), [Hung()], candidates, [away, denser], store, 0.1


@pytest.fixture(scope="module")
def study(asked):
    return finish(limits_study(*asked))


def test_every_disturbance_is_tried_at_every_size(study, store):
    series = study_module.full_series(study.worst["2 × type1"])
    assert [curve.name for curve in study.curves[1:]] == [one[0].name for one in series]
    sizes = [[point.disturbance.size for point in curve.points] for curve in study.curves[1:]]
    assert sizes == [[disturbance.size for disturbance in one] for one in series]
    assert [point.disturbance for point in study.curves[0].points] == [SensorFailure.each(0), SensorFailure.each(1)]
    assert all(0 <= point.precision.value <= 1 for curve in study.curves for point in curve.points)
    assert all(-1 <= point.change.value <= 1 for curve in study.curves for point in curve.points)
    trials_at_home = 2 * (1 + 2 + sum(map(len, series))) + 2 + 1  # by two detectors; by type; padded
    assert len(list(store.glob("*.npz"))) == trials_at_home + 2 + 2 + 3  # that which ships: at home and twice away


def test_progress_ends_at_its_total(asked):
    last = list(limits_study(*asked))[-1]
    assert last.done == last.total


def test_a_study_goes_on_where_it_was(study, asked, monkeypatch):
    def twice(*_arguments, **_options):
        raise AssertionError("this was tried before")

    monkeypatch.setattr(trials_module, "detect", twice)
    again = finish(limits_study(*asked))
    assert [curve.undisturbed for curve in again.curves] == [curve.undisturbed for curve in study.curves]
    assert limit_rows(again) == limit_rows(study)


def test_a_trial_is_kept_by_all_that_it_follows_from(store, study, monkeypatch):
    tried = []

    def noted(detector, *_arguments, **_options):
        tried.append(detector)
        raise InterruptedError

    monkeypatch.setattr(trials_module, "detect", noted)
    finish(trials(ground(), Hung(), DropOff(0.25), [one_tested(1)], store))
    others = [
        (ground(seed=9), Hung(), DropOff(0.25), [one_tested(1)]),
        (ground(), Hung(), DropOff(0.26), [one_tested(1)]),
        (ground(), Hung(), DropOff(0.25), [one_tested(7)]),
        (ground(), Hung(), YawError(0.1, 1 - study.worst["2 × type1"]), [one_tested(1)]),
    ]
    for other in others:
        with pytest.raises(InterruptedError):
            finish(trials(*other, store))
    assert len(tried) == len(others)


def test_what_is_kept_is_what_was_found(store, tmp_path):
    kept, made = (finish(trials(ground(), Hung(), Disturbance(), [one_tested(1)], at))[0] for at in (store, tmp_path))
    for one, other in ((kept.evaluation, made.evaluation), (kept.from_border, made.from_border)):
        assert one.average_precision == other.average_precision
        np.testing.assert_array_equal(one.wanted.distance, other.wanted.distance)
        np.testing.assert_array_equal(one.detections.distance, other.detections.distance)
    # In a square of 60 m: car and van at x = -10 and -20 on y = 2, 5 m farther in the second frame; four stand still.
    drive, stand = [20, 10, 25, 15], 2 * [6, 18, 20, 18]
    assert sorted(made.from_border.wanted.distance.tolist()) == pytest.approx(sorted(drive + stand))


def test_there_is_a_row_for_each_question(study):
    rows = limit_rows(study)
    regimes = [row.regime for row in rows]
    assert len(set(regimes)) == len(regimes)
    for words in (
        "seeds",
        "rain or fog",
        "yaw wrong (S",
        "sensor lost with",
        "trained on type2",
        "random sites",
        "away",
    ):
        assert any(words in regime for regime in regimes), words
    for words in ("few returns", "border of the region", "over-full", "padded with zeros"):
        assert any(words in regime for regime in regimes), words
    assert all(row.begins and row.how and row.answer for row in rows)
    assert not any("nan" in row.begins for row in rows)


def test_charts_are_drawn(study, tmp_path):
    save_limits_chart(tmp_path / "limits.png", study)
    save_transfer_chart(tmp_path / "foreign.png", study)
    assert imread(tmp_path / "limits.png").shape[1] > 1500
    assert imread(tmp_path / "foreign.png").shape[1] > 1000


def test_a_course_trains_all_that_the_study_tries():
    configurations = [
        SimpleNamespace(name=f"{count} × {sensor}", sensor=sensor, count=count)
        for sensor in ("type1", "type2", "type3")
        for count in (1, 2)
    ]
    whole = training_plan(configurations, NETWORK, TrainingSettings(steps=1800), seeds=3, padding=True)
    names = [model.name for model in whole.models]
    by_type = [f"detector-{sensor}" for sensor in ("type1", "type2", "type3")]
    assert names == [f"detector-{seed}" for seed in (1, 2, 3)] + by_type + [
        f"detector-{seed}-padded" for seed in (1, 2, 3)
    ]
    assert {model.training.steps for model in whole.by_type.values()} == {600}
    assert [one.name for one in whole.by_type["type2"].configurations] == ["1 × type2", "2 × type2"]
    candidates = whole.candidates([one_tested(1).detector] * len(names))
    assert [one.name for one in candidates.tested] == names[:3] == [one.name for one in candidates.unpadded]
    assert [one.name for one in candidates.padded] == names[6:]
    assert not training_plan(configurations, NETWORK, TrainingSettings(), seeds=1, padding=False).padded


def curve(*highs):
    points = [
        DisturbanceEffect(
            DropOff(0.1 * (number + 1)),
            IntervalEstimate(0.8, 0.7, 0.9),
            IntervalEstimate(high - 0.01, high - 0.02, high),
        )
        for number, high in enumerate(highs)
    ]
    return DisturbanceCurve("4 × type2", IntervalEstimate(0.9, 0.88, 0.92), tuple(points))


def test_it_begins_at_the_first_size_that_chance_does_not_explain():
    assert curve(0.01, 0.0, -0.001, -0.2).begins.disturbance.size == pytest.approx(0.3)
    assert curve(0.01, 0.0).begins is None


def test_changes_are_told_in_points():
    assert format_points(IntervalEstimate(-0.041, -0.06, 0.0004)) == "-4.1 points [-6.0, +0.0]"
