"""Placement over pose errors, failures and traffic by the command, from a scene to the folder of its result."""

import json
from unittest.mock import patch

from headless import place

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.choosing.placement.scenarios import DEFAULT_COUNTS
from seip_addon.core.output.results.file_names import POSE_ERROR_PICTURES, TRAFFIC_PICTURE
from seip_addon.scene.result_folder import FILES

COARSE = ["--sensor", "type1", "--heights", "5.4", "--grid", "8", "--spacing", "25", "--no-render"]


@pytest.fixture(scope="module")
def run(small_scene):
    def run(folder, *options):
        with patch.dict(DEFAULT_COUNTS, {"pose-errors": (3, 20)}):
            place.main([str(small_scene), "-o", str(folder), *COARSE, *options])

    return run


ERRORS = ["--pose-errors", "0.3", "2"]


def test_it_writes_a_result_with_the_objective_and_the_evaluation(tmp_path, capsys, run):
    run(tmp_path, "--count", "2", *ERRORS, "--risk", "worst")
    names = {path.name for path in tmp_path.iterdir()}
    assert {*FILES, *POSE_ERROR_PICTURES, "visibility.npz"} - {"view.png"} <= names
    record = json.loads((tmp_path / "placement.json").read_text(encoding="utf-8"))
    assert "coverage in the worst scenario" in json.dumps(record)
    goal = record["settings"]["goal"]
    assert (goal["risk"], goal["scenarios"]["pose_errors"]["tilt_deg"]) == ("worst", 2.0)
    assert "unseen draws" in capsys.readouterr().out


def test_failures_of_nominal_sensors_are_optimised_without_pose_errors(tmp_path, capsys, run):
    run(tmp_path, "--count", "2", "--failures", "worst")
    record = json.loads((tmp_path / "placement.json").read_text(encoding="utf-8"))
    assert record["settings"]["goal"]["scenarios"]["kind"] == "nominal"
    assert record["notes"][0].startswith("chosen for coverage after the loss of the most important sensor: ")
    left = min(one["coverage_alone"] for one in record["sensors"])  # of two sensors the better one fails
    assert record["objective"]["value"] == pytest.approx(left * record["counts"]["targets"])
    assert f"coverage after the loss of the most important sensor: {left:.2%}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--pose-errors", "--coverage", "0.5"], "needs a number of sensors or a budget"),
        (["--pose-errors", "--criterion", "returns"], "choose the criterion road"),
        (["--failures", "worst", "--risk", "none"], "cannot be combined with the risk none"),
        (["--pose-errors", "--traffic"], "leave out --pose-errors or --traffic"),
        (["--failures", "mean", "--traffic"], "cannot be combined with traffic"),
        (["--seed", "1"], "the seed of the scenarios has no effect on nominal poses and the empty road: choose"),
        (["--coverage", "0.5", "--pose-errors"], r"give one of these, or only evaluate \(risk none\)$"),
    ],
)
def test_parts_of_an_objective_that_contradict_each_other_are_refused(tmp_path, run, options, sentence):
    with pytest.raises(SeipError, match=sentence):
        run(tmp_path / "out", *options)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("option", "sentence"),
    [
        (("--pose-errors", "0.3", "-2"), "the error of tilt must be 0 to 57°, not -2°"),
        (("--pose-errors", "1", "2", "3"), "takes metres and degrees, not 3 numbers"),
    ],
)
def test_a_number_out_of_its_limits_is_named_before_any_work(tmp_path, option, sentence, run):
    with pytest.raises(SeipError, match=sentence):
        run(tmp_path / "out", *option)
    assert not (tmp_path / "out").exists()


IN_TRAFFIC = ["--sensor", "vlp16", "--heights", "5.4", "--grid", "8", "--spacing", "25", "--no-render", "--traffic"]


def test_it_writes_a_result_and_says_what_traffic_hides(small_scene, tmp_path, capsys):
    with patch.dict(DEFAULT_COUNTS, traffic=(4, 24)):
        place.main([str(small_scene), "-o", str(tmp_path), *IN_TRAFFIC, "--count", "2"])
    names = {path.name for path in tmp_path.iterdir()}
    assert {*FILES, TRAFFIC_PICTURE, "visibility.npz"} - {"view.png"} <= names
    record = json.loads((tmp_path / "placement.json").read_text(encoding="utf-8"))
    goal, notes = record["settings"]["goal"], record["notes"]
    assert goal["scenarios"]["kind"] == "traffic"
    assert "in traffic, on average over 4 instants" in notes[0]
    said = capsys.readouterr().out
    assert "chosen for the empty road: " in said
    assert "of the vehicles of one run are within 1 m of one of another at the same instant (" in said
    assert any(note.startswith("this placement sees ") and note in said for note in notes)
