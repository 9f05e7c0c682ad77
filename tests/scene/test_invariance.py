"""What must not matter does not: names, the order of objects, where in the map a site lies."""

from pathlib import Path

import bpy
import numpy as np

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.site import make_site
from seip_addon.scene import contract
from seip_addon.scene.read import read_scene

SCENES = Path(__file__).resolve().parents[2] / "scenes"
COARSE = CandidateSettings(sensors=("type1", "type3"), heights=(5.4,), spacing=24.0)


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
