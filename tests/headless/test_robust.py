"""The robust command, from a scene to the folder of its result."""

import json

from headless import robust

import pytest

from seip_addon.core.errors import SeipError
from seip_addon.scene.result_folder import FILES

COARSE = ["--sensor", "type1", "--heights", "5.4", "--grid", "8", "--spacing", "25", "--delta", "6", "--no-render"]


@pytest.fixture(scope="module")
def run(small_scene):
    def run(folder, *options):
        robust.main([str(small_scene), "-o", str(folder), *COARSE, "--scenarios", "3", "--draws", "20", *options])

    return run


def test_it_writes_a_result_and_says_what_it_was_chosen_for(tmp_path, capsys, run):
    run(tmp_path, "--count", "2", "--objective", "worst")
    names = {path.name for path in tmp_path.iterdir()}
    assert {*FILES, *robust.CHARTS, "visibility.npz"} - {"view.png"} <= names
    record = json.loads((tmp_path / "placement.json").read_text(encoding="utf-8"))
    assert "coverage in the worst scenario" in json.dumps(record)
    asked = record["settings"]["robustness"]
    assert (asked["risk"]["tail"], asked["errors"]["tilt_deg"]) == (0.0, 2.0)
    assert "unseen draws" in capsys.readouterr().out


def test_errors_that_cannot_be_meant_are_refused(tmp_path, run):
    with pytest.raises(SeipError, match=r"--tilt-error must be at most 57\.3 degrees, not 90"):
        run(tmp_path, "--tilt-error", "90")


def test_one_sensor_cannot_be_lost_of_one(tmp_path, run):
    with pytest.raises(SeipError, match="at least 2 sensors"):
        run(tmp_path, "--count", "1", "--failure", "worst")
    assert not (tmp_path / "visibility.npz").exists()  # refused before any ray is cast


@pytest.mark.parametrize(
    ("option", "sentence"),
    [
        (("--tilt-error", "-2"), "the error of tilt must be 0 to 57°, not -2°"),  # not of yaw, which follows it
        (("--position-error", "-1"), "the error of position must be 0 to 100 m"),
    ],
)
def test_a_slip_is_named_before_any_work(tmp_path, option, sentence, run):
    with pytest.raises(SeipError, match=sentence):
        run(tmp_path / "out", *option)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("option", "sentence"),
    [
        (("--scenarios", "0"), "--scenarios must be 1 to 10,000, not 0"),
        (("--scenarios", "1000000000"), "--scenarios must be 1 to 10,000, not 1000000000"),
        (("--draws", "0"), "--draws must be 1 to 100,000, not 0"),
        (("--tail", "nan"), "--tail must be 0 to 1, not nan"),
        (("--central-weight", "1e308"), "--central-weight must be 0 to 1,000,000, not 1e308"),
    ],
)
def test_a_number_out_of_its_limits_is_named_by_its_option(tmp_path, option, sentence, run):
    with pytest.raises(SeipError, match=sentence):
        run(tmp_path / "out", *option)
    assert not (tmp_path / "out").exists()
