"""The command on placements that it draws, and on those of folders."""

import csv
import json

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless.studies import stored_detections
from headless.studies.detection import command as evaluate

COARSE = ["--heights", "5.4", "--grid", "8", "--spacing", "20"]
BRIEF = ["--every", "14", "--steps", "2", "--from-scratch"]
DRAWN = ["--sensor", "type1", "--placements", "5", "--count", "2", "--training-placements", "2", "--trainings", "2"]


@pytest.fixture(scope="module")
def run(small_scene):
    def run(folder, *options):
        evaluate.main([str(small_scene), "-o", str(folder), *COARSE, *BRIEF, *options])

    return run


@pytest.fixture(scope="module")
def study(run, tmp_path_factory):
    folder = tmp_path_factory.mktemp("placements")
    run(folder, *DRAWN)
    return folder


def test_tables_hold_every_placement(study):
    rows = list(csv.DictReader((study / "placements.csv").read_text(encoding="utf-8").splitlines()))
    kinds = [row["kind"] for row in rows]
    assert kinds[:5] == ["optimal", "random", "random", "in between", "in between"]
    assert set(kinds[5:]) <= {"optimal by other criteria"}
    assert float(rows[0]["coverage"]) == max(float(row["coverage"]) for row in rows)
    record = json.loads((study / "placements.json").read_text(encoding="utf-8"))
    assert record["schema"] == "seip-placements-study/1"
    assert [one["criteria"]["coverage"] for one in record["placements"]] == pytest.approx(
        [float(row["coverage"]) for row in rows], abs=1e-4
    )
    evaluated = [{sensor["pose"] for sensor in one["sensors"]} for one in record["placements"]]
    assert not any(set(trained) in evaluated for trained in record["training_placements"])
    assert record["criteria"][0]["key"] == "coverage"
    assert record["sentences"][-1].startswith("this supports no conclusion")


def test_a_study_that_was_stopped_goes_on_where_it_was(run, study, tmp_path, monkeypatch):
    """With the detectors and all but one of the placements kept, one alone is evaluated, to the same bytes."""
    for path in (study / "visibility.npz", study / "detector-1.pt", study / "detector-2.pt"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "detections").mkdir()
    for path in sorted((study / "detections").iterdir())[1:]:
        (tmp_path / "detections" / path.name).write_bytes(path.read_bytes())
    evaluated = []
    detect_in_runs = stored_detections.detect_in_runs

    def counted(simulator, placement, runs, detectors, threads):
        evaluated.append((placement.name, len(detectors)))
        return detect_in_runs(simulator, placement, runs, detectors, threads)

    counted.__module__ = detect_in_runs.__module__
    monkeypatch.setattr(stored_detections, "detect_in_runs", counted)
    run(tmp_path, *DRAWN)
    assert [detectors for _, detectors in evaluated] == [1]
    for name in ("placements.csv", "placements.json", "criteria.png", "coverage_and_ap.png"):
        assert (tmp_path / name).read_bytes() == (study / name).read_bytes(), name
