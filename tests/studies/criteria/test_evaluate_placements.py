"""The command on placements that it draws, and on those of folders."""

import csv
import json

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless import place, survey
from headless.studies import stored_detections
from headless.studies.detection import command as evaluate

from matplotlib.image import imread

from seip_addon.core.errors import SeipError
from seip_addon.core.output.results.placement_file import save_placement

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


def record_alone(folder, scene, surveyed, solution, record, **_):
    """Write of a result what is read again."""
    save_placement(folder / "placement.json", record)


@pytest.fixture(scope="module")
def placed(small_scene, tmp_path_factory):
    """Folders of placements: of two types, of one, and of one that has lost its sensors."""
    folder = tmp_path_factory.mktemp("placed")
    sensors = {"mixed": ["type1", "type2", "--require", "signal pole 0"], "alone": ["type1"]}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(survey, "write_result_folder", record_alone)
        for name, options in sensors.items():
            place.main([str(small_scene), "-o", str(folder / name), "--count", "2", *COARSE, "--sensor", *options])
    record = json.loads((folder / "alone" / "placement.json").read_text(encoding="utf-8"))
    nothing = {"sensors": [], "price_usd": 0, "coverage": record["coverage"] | {"whole": 0, "seen_twice": 0}}
    for name, change in {"empty": nothing, "elsewhere": {"site": record["site"] | {"name": "Away"}}}.items():
        (folder / name).mkdir()
        (folder / name / "placement.json").write_text(json.dumps(record | change), encoding="utf-8")
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


def test_without_training_the_shipped_detector_is_evaluated(run, tmp_path):
    """On all runs but the first quarter, with the placements that other criteria rate best next to the drawn ones."""
    run(tmp_path, "--sensor", "type1", "--placements", "5", "--count", "2", "--trainings", "0", "--effort", "1")
    record = json.loads((tmp_path / "placements.json").read_text(encoding="utf-8"))
    assert not list(tmp_path.glob("detector-*"))
    assert record["training_placements"] == []
    known, tests = (len(record["traffic"][what]) for what in ("training", "test"))
    assert known == (known + tests) // 4
    placed = record["placements"]
    values = {one["key"]: [own["criteria"][one["key"]] for own in placed] for one in record["criteria"]}
    assert {"coverage", "occupancy_entropy", "returns", "egvs", "inspe", "pe_vgop"} <= set(values)
    best = [number for number, own in enumerate(placed) if own["kind"].startswith("optimal")]
    for key in ("coverage", "returns"):
        assert max(values[key][number] for number in best) >= max(values[key]) - 1e-6, key
    assert set(placed[0]["of_classes"]) == {"vehicles", "two-wheelers", "pedestrians"}


def test_training_is_needed_without_drawn_placements(run, tmp_path):
    with pytest.raises(SeipError, match="--trainings must be 1 or more without --placements, not 0"):
        run(tmp_path, "--trainings", "0")


def test_charts_are_drawn(study):
    for name in ("coverage_and_ap", "criteria"):
        assert imread(study / f"{name}.png").shape[1] > 600


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


def test_other_placements_do_not_go_on_with_a_training(run, study, tmp_path):
    (tmp_path / "detector-1.pt").write_bytes((study / "detector-1.pt").read_bytes())
    with pytest.raises(SeipError, match="other settings or recordings"):
        run(tmp_path, *DRAWN, "--placement-seed", "3")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--placements", "3"), "3 placements say nothing of a correlation"),
        (("--count", "30"), "30 sensors are requested, but there are"),
        (("--sensor", "type1", "type2"), "placements of one type are compared"),
        (("--placement", "somewhere"), "name either --placements"),
    ],
)
def test_what_cannot_be_studied_gets_a_sentence(run, tmp_path, options, sentence):
    with pytest.raises(SeipError, match=sentence):
        run(tmp_path, *DRAWN, *options)
    assert not (tmp_path / "placements.json").exists()


def test_folders_are_evaluated_alone(run, placed, tmp_path):
    mixed, alone = placed / "mixed", placed / "alone"
    run(tmp_path, "--trainings", "1", "--sensor", "type1", "--only-placement", "--placement", str(mixed), str(alone))
    record = json.loads((tmp_path / "evaluation.json").read_text(encoding="utf-8"))
    assert [one["name"] for one in record["configurations"]] == ["2 × mixed", "2 × alone"]
    assert record["claims"] == []
    for one, folder in zip(record["configurations"], (mixed, alone), strict=True):
        placement = json.loads((folder / "placement.json").read_text(encoding="utf-8"))
        assert [sensor["model"] for sensor in one["sensors"]] == [sensor["sensor"] for sensor in placement["sensors"]]
        assert one["coverage"] == pytest.approx(placement["coverage"]["whole"], abs=1e-9)
        assert one["price_usd"] == placement["price_usd"]
        for sensor, recorded in zip(one["sensors"], placement["sensors"], strict=True):
            assert sensor["xyz"] == pytest.approx(recorded["local_m"], abs=1e-5)
    assert (tmp_path / "errors_mixed.png").exists()


@pytest.mark.slow
def test_folders_are_evaluated_beside_numbers_and_types(run, placed, tmp_path):
    run(tmp_path, "--trainings", "1", "--sensor", "type1", "--placement", str(placed / "mixed"))
    rows = list(csv.DictReader((tmp_path / "detection.csv").read_text(encoding="utf-8").splitlines()))
    assert [(row["sensor"], row["count"]) for row in rows] == [
        ("type1", "1"),
        ("type1", "2"),
        ("type1", "4"),
        ("mixed", "2"),
    ]
    record = json.loads((tmp_path / "evaluation.json").read_text(encoding="utf-8"))
    assert all("mixed" not in claim["text"] + claim["evidence"] for claim in record["claims"])


@pytest.mark.parametrize(
    ("folders", "sentence"),
    [
        (("empty",), "has no sensors"),
        (("elsewhere",), "is of the scene 'Away' at .*, not of 'Small junction'"),
        (("nowhere",), "cannot read .*placement.json"),
        (("alone", "alone"), "two placements are called 'alone'"),
        ((), "--only-placement leaves nothing to evaluate"),
    ],
)
def test_folders_that_cannot_be_evaluated_get_a_sentence(run, placed, tmp_path, folders, sentence):
    named = ["--placement", *(str(placed / folder) for folder in folders)] if folders else []
    with pytest.raises(SeipError, match=sentence):
        run(tmp_path, "--sensor", "type1", "--only-placement", *named)
    assert not (tmp_path / "evaluation.json").exists()
