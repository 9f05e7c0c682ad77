"""The command from a scene and its traffic to what each placement detects."""

import csv
import json
from dataclasses import replace
from itertools import chain

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless.detection import suitability
from headless.detection.detector import SHIPPED_DETECTOR, Detector, TrainingRecord
from headless.detection.rules import RULES
from headless.studies.detection import command as evaluate
from headless.studies.detection.case_study import read_traffic

import numpy as np
from matplotlib.image import imread

from seip_addon.core.errors import SeipError
from seip_addon.core.sensing.traffic.trajectories import Trajectories
from seip_addon.core.workflows.traffic_runs import runs_in
from tests.builders.small_scene import make_run

COARSE = ["--sensor", "type1", "--heights", "5.4", "--grid", "8", "--spacing", "20"]
BRIEF = ["--every", "29", "--steps", "2", "--trainings", "2"]


@pytest.fixture(scope="module")
def runs(small_scene):
    return sorted((small_scene.parent / "small_traffic").iterdir())


@pytest.fixture(scope="module")
def run(small_scene, runs):
    def run(folder, *options, runs=runs):
        traffic = ["--traffic", *map(str, runs)]
        evaluate.main([str(small_scene), "-o", str(folder), *COARSE, *BRIEF, *traffic, *options])

    return run


@pytest.fixture(scope="module")
def folder(run, tmp_path_factory):
    folder = tmp_path_factory.mktemp("evaluation")
    run(folder, "--ablation", "--from-scratch")
    return folder


def test_charts_show_what_was_found(folder):
    for name in ("ap_by_count", "ap_by_price", "ap_by_coverage", "precision_recall", "where_type1", "errors_type1"):
        assert imread(folder / f"{name}.png").shape[1] > 600
    assert (folder / "detector-2-padded.png").exists()


def test_the_table_has_a_row_for_each_detector_and_placement(folder):
    rows = list(csv.DictReader((folder / "detection.csv").read_text(encoding="utf-8").splitlines()))
    cells = {(row["detector"], row["count"], row["padded"]) for row in rows}
    assert cells == {
        (f"detector-{seed}{'-padded' if padded else ''}", str(count), str(padded).lower())
        for seed in (1, 2)
        for padded in (False, True)
        for count in (1, 2, 4)
    }
    coverage = [float(row["coverage"]) for row in rows[:3]]
    assert coverage == sorted(coverage)
    assert all(0 <= float(row["ap_bev_0.7"]) <= float(row["ap_bev_0.5"]) + 1e-9 <= 1 for row in rows)
    assert {row["frames"] for row in rows} == {"2"}
    for rule in RULES:
        assert all(row[f"ap_{rule}_low"] == row[f"ap_{rule}_high"] == "" for row in rows)  # of two runs
        assert {(row[f"ap_{rule}"] == "") == (row[f"road_users_{rule}"] == "0") for row in rows} == {True}
    assert {row["road_users_pedestrian_0.5"] for row in rows} == {"0"}


def test_detectors_know_what_they_were_trained_on(run, tmp_path):
    run(tmp_path, "--trainings", "1")
    before, after = (Detector.load(path).training_record for path in (SHIPPED_DETECTOR, tmp_path / "detector-1.pt"))
    assert set(after.sensors) == {*before.sensors, "type1"}
    assert set(after.sites) == {*before.sites, "Small junction"}


def test_trainings_from_scratch_know_this_site_alone(folder):
    assert Detector.load(folder / "detector-1.pt").training_record == TrainingRecord(("type1",), ("Small junction",))


def test_the_record_says_what_was_for_what(folder):
    record = json.loads((folder / "evaluation.json").read_text(encoding="utf-8"))
    names = {what: [run["name"] for run in runs] for what, runs in record["traffic"].items()}
    assert names == {"training": ["run-1"], "validation": ["run-2"], "test": ["run-3", "run-4"]}
    assert [claim["number"] for claim in record["claims"]] == [5, 8, 9]
    assert {claim["verdict"] for claim in record["claims"]} == {"undecided"}  # after two steps
    assert all("no verdict, as the detectors reach an AP of" in claim["evidence"] for claim in record["claims"])
    assert all("AP was still rising when" in claim["evidence"] for claim in record["claims"])
    assert all(one["still_rising"] and list(one["validation"]) == ["2"] for one in record["detectors"])
    assert [one["name"] for one in record["configurations"]] == ["1 × type1", "2 × type1", "4 × type1"]


def test_an_evaluation_goes_on_and_ends_the_same(run, folder, tmp_path, capsys, monkeypatch):
    for name in ("visibility.npz", "detector-1.pt"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    monkeypatch.setattr(suitability, "MAX_OVERFULL_SHARE", -1.0)  # so that every cloud is worth a warning
    run(tmp_path, "--ablation", "--from-scratch")
    said = capsys.readouterr().out
    assert all(f"warning: {count} × type1: " in said for count in (1, 2, 4))
    assert "vehicles of one run within 1 m of one of another at the same instant: run-1 and run-2 4%, " in said
    assert "of the pillars with points have more than the 16 that are kept" in said
    assert "at most 0% of the parked road users of a test run" in said
    assert "warning: 2 test runs of traffic give no interval over traffic" in said
    assert "bev_0.7_moving" in said
    for path in folder.iterdir():
        assert path.read_bytes() == (tmp_path / path.name).read_bytes(), path.name


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--count", "0"], "--count must be 1 to 100,000, not 0"),
        (["--every", "nan"], "--every must be 0.001 to 86,400 s, not nan"),
        (["--trainings", "-1"], "--trainings must be 0 to 1,000, not -1"),
        (["--steps", "-5"], "--steps must be 1 to 10,000,000, not -5"),
        (["--scan-seed", "-1"], "--scan-seed must be at least 0"),
    ],
)
def test_an_option_out_of_its_limits_is_refused_by_its_name(run, tmp_path, options, sentence):
    with pytest.raises(SeipError, match=sentence):
        run(tmp_path / "out", *options)
    assert not (tmp_path / "out").exists()


def test_a_run_without_road_users_in_the_region_is_refused_before_training(run, runs, tmp_path):
    elsewhere = Trajectories.load(runs[2])
    moved = replace(elsewhere, position=elsewhere.position + 5000.0, source="of elsewhere")
    moved.save(tmp_path / "run-9.npz")
    with pytest.raises(SeipError, match=r"no road user of the run of traffic \(of elsewhere\) is ever in the region"):
        run(tmp_path, runs=[*runs, tmp_path / "run-9.npz"])
    assert not list(tmp_path.glob("detector*"))


@pytest.mark.parametrize(
    ("count", "trained", "aside", "tested"), [(4, 1, 1, 2), (5, 2, 1, 2), (6, 2, 1, 3), (16, 6, 2, 8)]
)
def test_half_the_runs_are_for_tests_and_an_eighth_for_validation(tmp_path, count, trained, aside, tested):
    paths = [tmp_path / f"run-{number}.npz" for number in range(count)]
    for number, path in enumerate(paths):
        make_run(number, 5.0).save(path)
    traffic = read_traffic(paths, np.zeros(3), 1.0)
    names = [[sampled.name for sampled in part] for part in (traffic.training, traffic.validation, traffic.test)]
    assert list(map(len, names)) == [trained, aside, tested]
    assert list(chain(*names)) == [path.stem for path in paths]


def test_runs_beside_a_scene_are_ordered_by_their_numbers(tmp_path):
    for name in ("run-10", "run-2", "run-1", "dense-3"):
        (tmp_path / f"{name}.npz").touch()
    assert [path.stem for path in runs_in(tmp_path)] == ["dense-3", "run-1", "run-2", "run-10"]


@pytest.mark.parametrize(
    ("options", "named", "sentence"),
    [
        ((), (0, 1, 2), "3 runs of traffic are too few"),
        ((), (0, 1, 2, 0), "run-1 and run-1 are nearly the same traffic"),
        (("--every", "0"), (0, 1, 2, 3), "--every must be"),
        (("--trainings", "0"), (0, 1, 2, 3), "--trainings must be 1 or more without --placements, not 0"),
        (("--device", "abacus"), (0, 1, 2, 3), "PyTorch cannot use the device 'abacus'"),
    ],
)
def test_what_cannot_be_evaluated_gets_a_sentence(run, runs, tmp_path, options, named, sentence):
    with pytest.raises(SeipError, match=sentence):
        run(tmp_path, *options, runs=[runs[number] for number in named])
