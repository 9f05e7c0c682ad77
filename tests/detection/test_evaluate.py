"""The command from a scene and its traffic to what each placement detects."""

import csv
import json

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless import evaluate
from headless.detection import suitability
from headless.detection.detector import Detector

from matplotlib.image import imread

from seip_addon.core.errors import SeipError

COARSE = ["--sensor", "type1", "--heights", "5.4", "--grid", "8", "--spacing", "20"]
BRIEF = ["--every", "29", "--steps", "2", "--seeds", "2"]


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
    run(folder, "--ablation")
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


def test_detectors_know_what_they_have_learnt_from(folder):
    training_record = Detector.load(folder / "detector-1.pt").training_record
    assert training_record.sensors == ("type1",)
    assert training_record.sites == ("Small junction",)


def test_the_record_says_what_was_for_what(folder):
    record = json.loads((folder / "evaluation.json").read_text(encoding="utf-8"))
    names = {what: [run["name"] for run in runs] for what, runs in record["traffic"].items()}
    assert names == {"training": ["run-1"], "validation": ["run-2"], "test": ["run-3", "run-4"]}
    assert [claim["number"] for claim in record["claims"]] == [5, 8, 9]
    assert [one["name"] for one in record["configurations"]] == ["1 × type1", "2 × type1", "4 × type1"]


def test_an_evaluation_goes_on_and_ends_the_same(run, folder, tmp_path, capsys, monkeypatch):
    for name in ("visibility.npz", "detector-1.pt"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    monkeypatch.setattr(suitability, "MAX_OVERFULL_SHARE", -1.0)  # so that every cloud is worth a warning
    run(tmp_path, "--ablation")
    said = capsys.readouterr().out
    assert all(f"warning: {count} × type1: " in said for count in (1, 2, 4))
    assert "vehicles of one run within 1 m of one of another at the same instant: run-1 and run-2 4%, " in said
    assert "of the pillars with points have more than the 16 that are kept" in said
    for path in folder.iterdir():
        assert path.read_bytes() == (tmp_path / path.name).read_bytes(), path.name


@pytest.mark.parametrize(
    ("options", "named", "sentence"),
    [
        ((), (0, 1, 2), "3 runs of traffic are too few"),
        ((), (0, 1, 2, 0), "run-1 and run-1 are nearly the same traffic"),
        (("--every", "0"), (0, 1, 2, 3), "time between frames"),
        (("--seeds", "0"), (0, 1, 2, 3), "one training or more"),
        (("--device", "abacus"), (0, 1, 2, 3), "torch cannot use the device 'abacus'"),
    ],
)
def test_what_cannot_be_evaluated_gets_a_sentence(run, runs, tmp_path, options, named, sentence):
    with pytest.raises(SeipError, match=sentence):
        run(tmp_path, *options, runs=[runs[number] for number in named])
