"""From a map, or from objects of one's own, to a site that is sound."""

from pathlib import Path

import bpy
import pytest

from seip_addon.scene import contract
from seip_addon.scene.read import read_scene

SCENES = Path(__file__).resolve().parents[2] / "scenes"


@pytest.fixture
def scene(add_on):
    return bpy.context.scene


def chosen(scene, junction=None):
    bpy.ops.seip.choose_map(filepath=str(SCENES / "junction.xodr"))
    site = scene.seip.site
    site.junction = site.junctions[0].name if junction is None else junction
    site.radius = 30.0
    return site


def test_smoke(scene):
    print([j.name for j in chosen(scene).junctions])
    assert bpy.ops.seip.build_site() == {"FINISHED"}
    assert bpy.ops.seip.check_site() == {"FINISHED"}
    for c in scene.seip.site.counts: print(c.name, ":", c.value)
    for c in scene.seip.site.problems: print(c.is_error, c.name, ":", c.text)
