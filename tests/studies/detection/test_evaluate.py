"""The command from a scene and its traffic to what each placement detects."""

import csv
import math

import pytest

from tests.builders.labelled_frames import near_and_far

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless.detection.average_precision import evaluate
from headless.detection.matching import Rule
from headless.detection.rules import RULES
from headless.studies.detection import command
from headless.studies.detection.case_study import false_positives

from matplotlib.image import imread

COARSE = ["--sensor", "type1", "--heights", "5.4", "--grid", "8", "--spacing", "20"]
BRIEF = ["--every", "29", "--steps", "2", "--trainings", "2"]


@pytest.fixture(scope="module")
def runs(small_scene):
    return sorted((small_scene.parent / "small_traffic").iterdir())


@pytest.fixture(scope="module")
def run(small_scene, runs):
    def run(folder, *options, runs=runs):
        traffic = ["--traffic", *map(str, runs)]
        command.main([str(small_scene), "-o", str(folder), *COARSE, *BRIEF, *traffic, *options])

    return run


@pytest.fixture(scope="module")
def folder(run, tmp_path_factory):
    folder = tmp_path_factory.mktemp("evaluation")
    run(folder, "--from-scratch")
    return folder


def test_charts_show_what_was_found(folder):
    for name in ("ap_by_price", "errors_type1", "detector-2"):
        assert imread(folder / f"{name}.png").shape[1] > 600


def test_the_table_has_a_row_for_each_detector_and_placement(folder):
    rows = list(csv.DictReader((folder / "detection.csv").read_text(encoding="utf-8").splitlines()))
    cells = [(row["seed"], row["count"]) for row in rows]
    assert cells == [(seed, count) for seed in "12" for count in "124"]
    coverage = [float(row["coverage"]) for row in rows[:3]]
    assert coverage == sorted(coverage)
    assert all(0 <= float(row["ap_bev_0.7"]) <= float(row["ap_bev_0.5"]) + 1e-9 <= 1 for row in rows)
    assert {row["frames"] for row in rows} == {"2"}
    for rule in RULES:
        assert all(row[f"ap_{rule}_low"] == row[f"ap_{rule}_high"] == "" for row in rows)  # of two runs
        assert {(row[f"ap_{rule}"] == "") == (row[f"road_users_{rule}"] == "0") for row in rows} == {True}
    assert {row["road_users_pedestrian_0.5"] for row in rows} == {"0"}


def test_an_evaluation_goes_on_and_ends_the_same(run, folder, tmp_path, capsys):
    for name in ("visibility.npz", "detector-1.pt"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    run(tmp_path, "--from-scratch")
    said = capsys.readouterr().out
    assert "at most 7% of the vehicles of one run are within 1 m of one of another at the same instant" in said
    assert "warning: 2 test runs of traffic give no interval over traffic" in said
    assert "bev_0.7_moving" in said
    for path in folder.iterdir():
        assert path.read_bytes() == (tmp_path / path.name).read_bytes(), path.name


AT_07 = Rule()


def test_false_positives_and_how_many_are_in_sparse_places():
    """Around half of the hits the density is under 30: both false ones are in sparser places."""
    evaluation = evaluate([near_and_far()], AT_07)
    assert false_positives(evaluation, 0.1) == (2, 1)
    # From 0.9 on there is one hit with density 40, and nothing is false.
    per_frame, sparse = false_positives(evaluation, 0.9)
    assert per_frame == 0
    assert math.isnan(sparse)
