"""Choice among finalists by detection: who wins, on which runs and frames, and what is said where it cannot be."""

import json
import sys
from dataclasses import asdict, replace

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

import headless.detection
from headless import finalists as finalists_command
from headless import place
from headless.detection import judging, shared_scans
from headless.detection.average_precision import evaluate
from headless.detection.judging import Score, counted_classes, judge_finalists, race, score_of
from headless.detection.rules import CLASSES, RULES

import bpy
import numpy as np

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Progress, finish
from seip_addon.core.choosing.placement.judgement import MEAN
from seip_addon.core.output.results.placement_record import load_placement, recorded_sensor
from seip_addon.core.sensing.lidar.catalogue import find_models, load_catalogue
from seip_addon.core.sensing.weather import Weather
from seip_addon.core.workflows.finalists import JUDGED_CLASSES, Finalist, JudgementRequest
from seip_addon.scene.blend_file import open_blend
from seip_addon.scene.read import read_scene
from tests.builders.labelled_frames import SIZES, box, detected, frame, truth
from tests.builders.small_junction import make_example
from tests.builders.small_scene import make_run

CARS = [box(20.0 * number) for number in range(10)]
WALKERS = [box(20.0 * number, 5.0, size=SIZES["pedestrian"]) for number in range(4)]


def test_the_core_names_the_classes_of_the_rules():
    assert tuple(CLASSES) == JUDGED_CLASSES


def judge_of(quality, spread, runs, random):
    """Return a judge whose scores are the quality with noise, less of it with more frames, and whom it judged."""
    judged = []

    def judge(left, number):
        judged.append(list(left))
        yield Progress(0, 1, "judge")
        noise = random.normal(0.0, spread / 2 ** (number / 2), (len(left), runs)) + random.normal(0.0, 0.05, runs)
        each = quality[left][:, None] + noise
        without = (each.sum(axis=1, keepdims=True) - each) / (runs - 1)
        return [Score(float(own.mean()), rest) for own, rest in zip(each, without, strict=True)]

    return judge, judged


@pytest.mark.parametrize("seed", range(50))
def test_a_race_drops_those_that_are_clearly_behind_and_never_the_best(seed):
    random = np.random.default_rng(seed)
    quality = random.permutation(np.concatenate([[0.8], random.uniform(0.4, 0.65, 11)]))
    judge, judged = judge_of(quality, 0.05, 8, random)
    best, *_ = finish(race(12, 3, judge))
    assert best == int(np.argmax(quality))
    assert all(best in left for left in judged)
    assert sum(map(len, judged)) < 18  # of 36


def test_a_race_keeps_those_that_are_alike_to_the_end():
    random = np.random.default_rng(1)
    quality = np.array([0.5, 0.8, 0.805, 0.55])
    judge, judged = judge_of(quality, 0.05, 8, random)
    ranked = finish(race(4, 3, judge))
    assert [len(left) for left in judged] == [4, 2, 2]
    assert (set(ranked[:2]), ranked[2:]) == ({1, 2}, [3, 0])


def test_without_intervals_nobody_is_dropped():
    rounds = []

    def judge(left, _number):
        rounds.append(left)
        yield Progress(0, 1, "judge")
        return [Score(0.1 * one) for one in left]

    assert finish(race(4, 3, judge)) == [3, 2, 1, 0]
    assert rounds == [[0, 1, 2, 3]] * 3


def told(run, number, cars, walkers=4):
    """A frame in which so many of ten cars and of four pedestrians are found."""
    kinds = ["car"] * 10 + ["pedestrian"] * 4
    found = [*CARS[:cars], *WALKERS[:walkers]]
    categories = ["car"] * cars + ["pedestrian"] * walkers
    there = truth([*CARS, *WALKERS], category=kinds)
    return frame(there, detected(found, [0.9] * len(found), category=categories), run=run, time=float(number))


@pytest.fixture(scope="module")
def site(small_scene, tmp_path_factory):
    """Geometry, models, eight runs, and a request with four finalists of one sensor."""
    open_blend(small_scene)
    folder = tmp_path_factory.mktemp("runs")
    paths = [folder / f"run-{number}.npz" for number in range(8)]
    for number, path in enumerate(paths):
        make_run(50 + number, 42.0).save(path)
    example = make_example(heights=(4.0,))
    sensors = [recorded_sensor(sensor, example.site) for sensor in example.deployment.sensors]
    each = tuple(
        Finalist(name, (number,), (replace(sensors[number % 2], height_m=4.0 + number),))
        for number, name in enumerate(("criterion", "second", "best", "bad"))
    )
    weights = dict(zip(JUDGED_CLASSES, (2.0, 1.0, 1.0), strict=True))
    models = find_models(load_catalogue(), sorted({sensor.sensor for sensor in sensors}))
    return read_scene(bpy.context.scene).geometry, JudgementRequest(each, weights), models, Weather(), paths


def test_the_winner_is_the_best_on_the_runs_of_the_choice_and_its_figures_are_of_the_others(site, monkeypatch):
    """Of ten cars 6, 8, 9 and 1 are found in the first four runs, and one less in the others by the best."""
    cars, asked = {"first": (6, 8, 9, 1), "others": (6, 9, 8, 1)}, []

    def detect(_shared, runs, _detector, _folder, *, placements, instants=slice(None)):
        part = "first" if runs[0].name == "run-0" else "others"
        asked.append((part, tuple(placements), sum(len(run.times[instants]) for run in runs)))
        yield Progress(0, 1, "detect")
        return [
            [told(run.name, number, cars[part][one]) for run in runs for number in range(len(run.times))[instants]]
            for one in placements
        ]

    monkeypatch.setattr(judging, "detect_with_all", detect)
    judgement = finish(judge_finalists(*site, "unused"))
    assert judgement.judged_on == ("run-0", "run-1", "run-2", "run-3")
    assert judgement.figures_on == ("run-4", "run-5", "run-6", "run-7")
    names = ("best", "second", "criterion", "bad")
    assert tuple(one.name for one in judgement.finalists) == names
    assert judgement.plain == 2
    # two-wheelers are nowhere: cars count twice as much as pedestrians, who are all found
    assert judgement.weights == {"vehicles": 2.0, "pedestrians": 1.0}
    chosen = [one.precision[MEAN].value for one in judgement.finalists]
    assert chosen == pytest.approx([2.8 / 3, 2.6 / 3, 2.2 / 3, 1.2 / 3])
    winner, second, criterion, bad = judgement.finalists
    assert winner.final["vehicles"].value == pytest.approx(0.8)
    assert winner.final[MEAN].value == pytest.approx(2.6 / 3)
    assert (winner.behind, bad.behind, bad.final) == (None, None, None)
    assert second.behind.value == pytest.approx(-0.2 / 3)
    assert criterion.behind.interval == pytest.approx((0.4 / 3, 0.4 / 3))
    # all differences are certain, so that after the first round only the leader is left
    assert [part for part, *_ in asked] == ["first", "others"]
    assert asked[0][1:] == ((0, 1, 2, 3), 8)
    assert asked[1][1:] == ((2, 1, 0), 32)


def test_scores_are_weighted_means_and_leave_out_rare_classes():
    frames = [told(f"run {run}", 0, cars, 2) for run, cars in enumerate((5, 6, 7, 8))]
    weights = counted_classes(frames, {"vehicles": 1.0, "two-wheelers": 1.0, "pedestrians": 3.0})
    assert weights == {"vehicles": 1.0, "pedestrians": 3.0}
    score = score_of(frames, weights)
    parts = [evaluate(frames, RULES[CLASSES[name]]).average_precision for name in weights]
    assert score.value == pytest.approx((parts[0] + 3 * parts[1]) / 4)
    assert score.without[0] == pytest.approx(score_of_three(frames[1:], weights))
    assert score_of(frames[:3], weights).without is None
    with pytest.raises(SeipError, match="too few road users"):
        counted_classes(frames, {"two-wheelers": 1.0})


def score_of_three(frames, weights):
    return score_of(frames, weights).value


@pytest.mark.parametrize(("count", "message"), [(1, "two runs of traffic or more"), (2, "2 runs of traffic are named")])
def test_runs_must_be_two_of_different_names(site, count, message):
    geometry, request, models, weather, paths = site
    given = [paths[0]] * count
    with pytest.raises(SeipError, match=message):
        finish(judge_finalists(geometry, request, models, weather, given, "unused"))


QUICK = ["--sensor", "vlp16", "--count", "1", "--heights", "4", "6", "--grid", "4", "--spacing", "16", "--no-render"]


@pytest.fixture(scope="module")
def judged(small_scene, tmp_path_factory):
    """The folder of a placement that was chosen among three finalists by the shipped detector."""
    folder = tmp_path_factory.mktemp("judged") / "out"
    place.main([str(small_scene), "-o", str(folder), *QUICK, "--finalists", "3"])
    return folder


def test_the_command_again_gives_the_same_bytes_and_scans_nothing(judged, small_scene, monkeypatch):
    before = load_placement(judged / "placement.json")
    assert before.judgement is not None
    assert before.judgement.judged_on == ("run-1", "run-2")
    assert set(before.poses) == set(before.judgement.finalists[0].poses)
    assert max(one.precision[MEAN].value for one in before.judgement.finalists) > 0.05

    def refuse(*_):
        raise AssertionError("detected again")

    monkeypatch.setattr(shared_scans, "detect", refuse)
    place.main([str(small_scene), "-o", str(judged), *QUICK, "--finalists", "3"])
    assert json.dumps(asdict(load_placement(judged / "placement.json").judgement)) == json.dumps(
        asdict(before.judgement)
    )


def test_missing_traffic_is_said_in_one_sentence_before_any_work(small_scene, tmp_path, monkeypatch):
    alone = tmp_path / "alone.blend"
    alone.write_bytes(small_scene.read_bytes())
    with pytest.raises(SeipError, match=r"no traffic to judge finalists in: .*--judge-on, .*alone_traffic"):
        place.main([str(alone), "-o", str(tmp_path / "out"), *QUICK, "--finalists", "3"])
    (tmp_path / "alone.net.xml").touch()

    def missing():
        raise SeipError("SUMO is not installed")

    monkeypatch.setattr(finalists_command, "find_sumo", missing)
    with pytest.raises(SeipError, match="SUMO is not installed"):
        place.main([str(alone), "-o", str(tmp_path / "out"), *QUICK, "--finalists", "3"])
    with pytest.raises(SeipError, match="add --finalists"):
        place.main([str(small_scene), "-o", str(tmp_path / "out"), *QUICK, "--judge-on", "run-1.npz"])
    assert not (tmp_path / "out").exists()


def test_missing_pytorch_is_said_with_the_command_that_installs_it(small_scene, tmp_path, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda _name: None)
    monkeypatch.delitem(sys.modules, "headless.detection")
    with pytest.raises(SystemExit, match="no package 'torch', which detection needs: run `make detection`"):
        place.main([str(small_scene), "-o", str(tmp_path / "out"), *QUICK, "--finalists", "3"])
    monkeypatch.setitem(sys.modules, "headless.detection", headless.detection)
