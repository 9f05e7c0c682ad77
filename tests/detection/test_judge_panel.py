"""Choice among finalists from the panel: the command's answer, with its figures where the placement is shown."""

from unittest.mock import MagicMock

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless import place

import bpy

import seip_addon
from seip_addon.core.output.results.placement_record import comparable, load_placement, parsed_record
from seip_addon.core.workflows import finalists
from seip_addon.panel import placement

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
