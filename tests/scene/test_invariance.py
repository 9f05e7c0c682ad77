"""What must not matter does not: names, the order of objects, where in the map a site lies."""

import re
from pathlib import Path

import bpy
import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.site import make_site
from seip_addon.core.world.opendrive.read import read_map
from seip_addon.core.world.streetscape.description import SiteDescription
from seip_addon.scene import contract
from seip_addon.scene.blend_file import new_file
from seip_addon.scene.build import build_scene
from seip_addon.scene.read import read_scene
from tests.builders.map_models import site_model

SCENES = Path(__file__).resolve().parents[2] / "scenes"
COARSE = CandidateSettings(sensors=("type1", "type3"), heights=(5.4,), spacing=24.0)
FAR = 5_000_000.0


def seen(site):
    return finish(compute_visibility(site, load_catalogue(), VisibilitySettings())).visible


def site_of(scene):
    return make_site(read_scene(scene).geometry, COARSE, grid_spacing=5.0)


def test_names_and_order_of_objects_change_nothing():
    bpy.ops.wm.open_mainfile(filepath=str(SCENES / "junction.blend"))
    scene = bpy.context.scene
    before = site_of(scene)
    rng = np.random.default_rng(7)
    for name in contract.INPUTS:
        collection = contract.find(scene, name)
        members = list(collection.objects) if collection else []
        for item in members:
            collection.objects.unlink(item)
        for index in rng.permutation(len(members)):
            members[index].name = f"obj {rng.integers(1_000_000)}"
            collection.objects.link(members[index])
    after = site_of(scene)
    assert after.triangles.tobytes() == before.triangles.tobytes()
    assert after.targets.xyz.tobytes() == before.targets.xyz.tobytes()
    assert after.candidates.xyz.tobytes() == before.candidates.xyz.tobytes()
    assert seen(after).tobytes() == seen(before).tobytes()


def moved(number, by):
    return f"{float(number) + by:.9f}"


@pytest.fixture
def far_map(tmp_path):
    """The shipped junction's map, 5,000 km away along both axes."""
    text = (SCENES / "junction.xodr").read_text(encoding="utf-8")
    shift = re.compile(r'(<geometry [^>]*?\bx=")([^"]+)("[^>]*?\by=")([^"]+)(")')
    text, count = shift.subn(lambda m: m[1] + moved(m[2], FAR) + m[3] + moved(m[4], -FAR) + m[5], text)
    assert count > 20
    path = tmp_path / "far.xodr"
    path.write_text(text, encoding="utf-8")
    return path


def built(path, near):
    model = finish(site_model(read_map(path), SiteDescription(map=path, near=near, radius=60.0)))
    scene = new_file()
    finish(build_scene(scene, model, path.name))
    return site_of(scene)


@pytest.mark.slow
def test_five_thousand_kilometres_change_nothing(far_map):
    here = built(SCENES / "junction.xodr", (0.0, 0.0))
    there = built(far_map, (FAR, -FAR))
    np.testing.assert_allclose(there.origin - here.origin, (FAR, -FAR, 0.0), atol=1e-6)
    np.testing.assert_allclose(there.targets.xyz, here.targets.xyz, atol=1e-4)
    np.testing.assert_allclose(there.candidates.xyz, here.candidates.xyz, atol=1e-4)
    assert seen(there).tobytes() == seen(here).tobytes()
