"""Detection from the panel: the command runs in another Python, for which a small program stands in here."""

import json
import os
import re
import sys
import time
from concurrent.futures import CancelledError
from pathlib import Path
from unittest.mock import MagicMock

import bpy
import pytest

from seip_addon.core.workflows.detection import DetectingPython
from seip_addon.panel import detection as panel
from seip_addon.panel import preferences
from seip_addon.panel.detection import SEIP_OT_detect
from seip_addon.panel.session import RunningWork
from seip_addon.scene.write import write_result
from tests.builders.small_junction import make_example

PRECISION = {
    "bev_0.7": {"average_precision": 0.7125, "interval": [0.66, 0.775], "road_users": 1234},
    "car_van_0.7": {"average_precision": 0.8, "interval": None, "road_users": 1000},
    "pedestrian_0.5": {"average_precision": 0.25, "interval": None, "road_users": 234},
}
RECORD = {"schema": "seip-detection/1", "average_precision": PRECISION, "warnings": ["it was trained on other types"]}

STAND_IN = """
import json, os, pathlib, sys, time
here = pathlib.Path(__file__).parent
(here / "pid").write_text(str(os.getpid()))
(here / "arguments.json").write_text(json.dumps(sys.argv[1:]))
assert pathlib.Path(sys.argv[2]).read_bytes()
output = pathlib.Path(sys.argv[sys.argv.index("-o") + 1])
(output / "kitti").mkdir(parents=True)
(output / "kitti" / "000000.txt").write_text("Car")
{end}
(output / "errors.png").write_bytes(b"picture")
(output / "detection.json").write_text(json.dumps({record!r}))
"""


@pytest.fixture
def placed(junction, small_scene, tmp_path):
    """A scene with two sensors, saved beside two runs of traffic."""
    example = make_example()
    write_result(junction, example.site, example.deployment)
    bpy.context.view_layer.update()
    junction.seip.detection.folder = str(tmp_path / "out")
    return junction


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """Put a program in the place of the command, that ends as it is told."""

    def put(end="", record=RECORD):
        package = tmp_path / "project" / "headless"
        package.mkdir(parents=True, exist_ok=True)
        (package / "__init__.py").touch()
        (package / "__main__.py").write_text(STAND_IN.format(end=end, record=record), encoding="utf-8")
        python = DetectingPython(Path(sys.executable), package.parent)
        monkeypatch.setattr(preferences, "detecting_python", lambda: python)
        return package

    put()
    return put


def drawn(monkeypatch):
    """Return the sentences, labels and operators of the panel."""
    said, layout = [], MagicMock()
    labels = layout.box().column().column().split().label
    monkeypatch.setattr(panel, "draw_sentence", lambda _, text, **__: said.append(text))
    monkeypatch.setattr(panel, "draw_reason", lambda _, text: bool(text) and not said.append(text))
    panel.draw(layout, bpy.context)
    return said, [call.kwargs["text"] for call in labels.call_args_list]


def files(folder):
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def test_without_torch_one_sentence_says_what_to_install_and_where(placed, monkeypatch):
    monkeypatch.setattr(preferences, "find_spec", lambda _: None)
    assert preferences.detecting_python() is None
    sentence = r"PyTorch, named in the extension's preferences: .*pip install 'FILE\.zip\[detection\]'.* checkout\."
    with pytest.raises(RuntimeError, match=sentence):
        bpy.ops.seip.detect()
    with pytest.raises(RuntimeError, match=sentence):
        bpy.ops.seip.judge_placement()
    said, _ = drawn(monkeypatch)
    assert len(said) == 1
    assert re.search(sentence, said[0])


def test_the_figures_stand_in_the_panel_and_the_files_in_the_folder(placed, stand_in, tmp_path, monkeypatch):
    assert bpy.ops.seip.detect() == {"FINISHED"}
    assert files(tmp_path / "out") == {"detection.json", "errors.png", str(Path("kitti", "000000.txt"))}
    assert json.loads(placed.seip.detection.record) == RECORD
    said, labels = drawn(monkeypatch)
    assert dict(zip(labels[::2], labels[1::2], strict=True)) == {
        "Road users": "1,234",
        "AP of all": "71.2% (66.0–77.5)",
        "Cars, vans": "80.0%",
        "Pedestrians": "25.0%",
    }
    assert said == [panel.MEANING, "it was trained on other types"]


def test_the_command_is_given_what_the_panel_shows(placed, stand_in, small_scene, tmp_path):
    package = stand_in()
    placed.seip.survey.rain, placed.seip.survey.fog, placed.seip.survey.visibility = 2.5, True, 300.0
    placed.seip.detection.detector = str(tmp_path / "own.pt")
    bpy.ops.seip.detect()
    verb, scene, dash_o, output, *rest = json.loads((package / "arguments.json").read_text())
    assert (verb, dash_o) == ("detect", "-o")
    assert Path(scene).parent == Path(output).parent
    runs = [str(small_scene.parent / "small_traffic" / f"run-{number}.npz") for number in (1, 2, 3, 4)]
    weather = ["--weather", "rain=2.5", "visibility=300.0"]
    assert rest == ["--traffic", *runs, "--detector", str(tmp_path / "own.pt"), *weather]


def test_sensors_that_were_changed_make_the_figures_old(placed, stand_in, monkeypatch, tmp_path):
    bpy.ops.seip.detect()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "kept.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "kept.blend"))
    assert panel.OTHER_SENSORS not in drawn(monkeypatch)[0]
    sensor = next(obj for obj in bpy.data.collections["SEIP Sensors"].objects if "seip_sensor" in obj)
    sensor.rotation_euler.z += 0.1
    bpy.context.view_layer.update()
    assert panel.OTHER_SENSORS in drawn(monkeypatch)[0]


def test_a_folder_without_runs_has_its_sentence(placed, stand_in, tmp_path):
    (tmp_path / "runs").mkdir()
    placed.seip.traffic.runs = str(tmp_path / "runs")
    with pytest.raises(RuntimeError, match=r"there is no run of traffic \(\.npz\) in .*runs: choose another folder"):
        bpy.ops.seip.detect()
    assert not (tmp_path / "out").exists()
    assert not placed.seip.detection.record


@pytest.mark.parametrize(
    ("end", "record", "words"),
    [
        ("print('warning: x'); sys.exit('error: broken.pt is no detector')", RECORD, "Error: broken.pt is no detector"),
        ("os.kill(os.getpid(), 9)", RECORD, "detection failed in .*: it ended with status -9"),
        ("", {**RECORD, "average_precision": {}}, r"damaged: average_precision\.bev_0\.7 is missing; detect again"),
    ],
)
def test_a_command_that_fails_has_its_sentence_and_leaves_nothing(placed, stand_in, tmp_path, end, record, words):
    stand_in(end, record)
    with pytest.raises(RuntimeError, match=words) as said:
        bpy.ops.seip.detect()
    assert "Traceback" not in str(said.value)
    assert not (tmp_path / "out").exists()
    assert not placed.seip.detection.record


def test_work_that_is_stopped_ends_the_command_and_leaves_nothing(placed, stand_in, tmp_path):
    package = stand_in(
        end="sys.stderr.write('detect in run-1: 25% done, 6 s left\\n'); sys.stderr.flush(); time.sleep(99)"
    )
    work = RunningWork("", next(SEIP_OT_detect.job(None, placed)))
    end = time.monotonic() + 30
    while (work.progress.done, work.progress.total) != (25, 100) and time.monotonic() < end:
        time.sleep(0.05)
    assert work.progress.what == "detect in run-1"
    process = int((package / "pid").read_text())
    os.kill(process, 0)
    work.stop()
    assert work.join(5.0)
    with pytest.raises(CancelledError):
        work.result()
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)
    assert not (tmp_path / "out").exists()
