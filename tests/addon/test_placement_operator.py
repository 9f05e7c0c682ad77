"""From a click to placed sensors: the operators do what the batch command does."""

from pathlib import Path

import bpy
import pytest

SCENE = Path(__file__).resolve().parents[2] / "scenes" / "junction.blend"


@pytest.fixture
def junction(add_on):
    bpy.ops.wm.open_mainfile(filepath=str(SCENE))
    scene = bpy.context.scene
    scene.seip.survey.heights = "8"
    scene.seip.survey.grid = 4.0
    scene.seip.survey.spacing = 12.0
    scene.seip.goal.count = 2
    return scene


def test_sensors_are_placed(junction):
    assert bpy.ops.seip.solve_placement() == {"FINISHED"}
    empties = [thing for thing in bpy.data.collections["SEIP Sensors"].objects if thing.type == "EMPTY"]
    assert len(empties) == 2


def test_a_mistake_is_one_sentence(junction):
    junction.seip.survey.heights = "high"
    with pytest.raises(RuntimeError, match="'high' is neither a height in metres"):
        bpy.ops.seip.solve_placement()
