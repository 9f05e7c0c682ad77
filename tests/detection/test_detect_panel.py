"""Detection from the panel, with the detector itself."""

import shutil
from unittest.mock import MagicMock

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless import detect, place
from headless.detection.detector import Detector
from headless.detection.rules import RULES
from headless.detection.settings import CLASS_CATEGORIES, NetworkSettings

import bpy

import seip_addon
from seip_addon.core.output.results.detection_record import MAIN_RULE
from seip_addon.core.output.results.placement_record import comparable, load_placement, parsed_record
from seip_addon.core.workflows import finalists
from seip_addon.panel import placement
from seip_addon.panel.detection import NAMES
from seip_addon.scene.write import write_result
from tests.builders.small_junction import make_example


def test_the_panel_names_rules_that_there_are():
    assert next(iter(RULES)) == MAIN_RULE
    categories = {rule: RULES[rule].categories for rule in NAMES if rule != MAIN_RULE}
    assert list(categories.values()) == list(CLASS_CATEGORIES.values())


@pytest.fixture
def placed(small_scene, tmp_path):
    """The small junction with two sensors, open and saved, with the add-on, and an untrained detector."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    seip_addon.register()
    bpy.ops.wm.open_mainfile(filepath=str(small_scene))
    example = make_example()
    write_result(bpy.context.scene, example.site, example.deployment)
    Detector(NetworkSettings(width=8, blocks=(1, 1, 1))).save(tmp_path / "detector.pt")
    detection = bpy.context.scene.seip.detection
    detection.folder, detection.detector = str(tmp_path / "panel"), str(tmp_path / "detector.pt")
    yield bpy.context.scene
    seip_addon.unregister()


@pytest.mark.slow
def test_panel_and_command_give_the_same_files(placed, small_scene, tmp_path):
    runs = tmp_path / "runs"
    runs.mkdir()
    shutil.copy(small_scene.parent / "small_traffic" / "run-1.npz", runs)
    placed.seip.traffic.runs = str(runs)
    assert bpy.ops.seip.detect() == {"FINISHED"}
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "placed.blend"), copy=True)
    named = ["--detector", placed.seip.detection.detector, "--traffic", str(runs / "run-1.npz")]
    record = placed.seip.detection.record
    detect.main([str(tmp_path / "placed.blend"), *named, "-o", str(tmp_path / "command")])
    assert record == (tmp_path / "command" / "detection.json").read_text(encoding="utf-8")
    panel, command = (
        {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
        for folder in (tmp_path / "panel", tmp_path / "command")
    )
    assert {path.suffix for path in panel} == {".json", ".png", ".txt"}
    assert panel == command


COARSE = ("--sensor", "vlp16", "--heights", "4", "6", "--grid", "4", "--spacing", "16", "--count", "1", "--no-render")


@pytest.fixture
def coarse(small_scene, tmp_path):
    """The small junction in the add-on, with coarse settings and one sensor to place."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    seip_addon.register()
    bpy.ops.wm.open_mainfile(filepath=str(small_scene))
    seip = bpy.context.scene.seip
    seip.survey.heights, seip.survey.grid, seip.survey.spacing = "4 6", 4.0, 16.0
    for one in seip.survey.types:
        one.use = one.name == "vlp16"
    seip.goal.count, seip.detection.folder = 1, str(tmp_path / "panel")
    yield bpy.context.scene
    seip_addon.unregister()


@pytest.mark.slow
def test_panel_and_command_choose_alike(coarse, small_scene, tmp_path, monkeypatch):
    monkeypatch.setattr(finalists.find_finalists, "__defaults__", (3,))
    assert bpy.ops.seip.judge_placement() == {"FINISHED"}
    panel = parsed_record(coarse.seip.result.record)
    assert panel.judgement is not None
    said = _drawn(monkeypatch, coarse)
    assert set(panel.judgement.sentences()) <= set(said)
    assert "Figures of the last placement:" not in said
    sensor = next(one for one in bpy.data.collections["SEIP Sensors"].objects if "seip_sensor" in one)
    sensor.location.x += 1.0
    bpy.context.view_layer.update()
    assert "Figures of the last placement:" in _drawn(monkeypatch, coarse)
    place.main([str(small_scene), *COARSE, "--finalists", "3", "-o", str(tmp_path / "command")])
    command = load_placement(tmp_path / "command" / "placement.json")
    assert panel.judgement == command.judgement
    assert comparable(panel) == comparable(command)


def _drawn(monkeypatch, scene):
    """Return the sentences of the section, without those of its closed parts."""
    said = []
    monkeypatch.setattr(placement, "draw_sentence", lambda _, text, **__: said.append(text))
    for name in ("draw_sections", "is_narrow"):
        monkeypatch.setattr(placement, name, lambda *_: False)
    placement.draw(MagicMock(), MagicMock(scene=scene))
    return said
