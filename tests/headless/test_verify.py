"""The command `seip verify`: what it finds in a simulated recording, writes, and adds to the scene."""

import re
import shutil
from dataclasses import replace

from headless import verify

import bpy
import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.output.results.verification_record import load_verification
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.site.scene_geometry import Mesh
from seip_addon.scene import contract
from seip_addon.scene.blend_file import open_blend, save_blend
from seip_addon.scene.read import read_scene
from seip_addon.scene.sensors import read_sensors
from tests.builders.site_recording import changed, save_site_recording
from tests.builders.small_junction import box_triangles
from tests.builders.small_scene import make_run

SHIFT = np.array([0.3, -0.2, 0.15])
PLANNED = {"S1": (9.5, 9.5, 6.0), "S2": (-9.5, -9.5, 6.0)}
KIOSK = Mesh("kiosk", box_triangles((9.0, -13.0, 0.0), (11.0, -11.5, 3.0)))
GONE = "hoarding"
HOARDING = Mesh(GONE, box_triangles((16.0, 11.0, 0.0), (22.0, 11.3, 3.0)))


def put_plan(scene):
    mesh = bpy.data.meshes.new(GONE)
    corners = HOARDING.triangles.reshape(-1, 3)
    mesh.from_pydata(corners.tolist(), [], np.arange(len(corners)).reshape(-1, 3).tolist())
    contract.find(scene, contract.OCCLUDERS).objects.link(bpy.data.objects.new(GONE, mesh))
    sensors = contract.find_or_make(scene, contract.SENSORS)
    for label, at in PLANNED.items():
        empty = bpy.data.objects.new(label, None)
        empty["seip_sensor"], empty["seip_label"], empty.location = "os0_32", label, at
        sensors.objects.link(empty)
    bpy.context.view_layer.update()


@pytest.fixture(scope="module")
def plan(small_scene, tmp_path_factory):
    """A scene with two sensors, and sweeps of both off their plan, with a kiosk more and a hoarding less."""
    folder = tmp_path_factory.mktemp("verify")
    open_blend(small_scene)
    put_plan(bpy.context.scene)
    save_blend(folder / "plan.blend")
    geometry = read_scene(bpy.context.scene).geometry
    true = [replace(one, xyz=one.xyz + SHIFT) for one in read_sensors(bpy.context.scene, load_catalogue())]
    save_site_recording(
        folder / "july", changed(geometry, GONE, [KIOSK]), true, make_run(7, 30.0).moved_to(geometry.origin)
    )
    return folder


def names(path):
    open_blend(path)
    return {mesh.name for mesh in read_scene(bpy.context.scene).geometry.occluders}


def test_poses_changes_units_and_the_corrected_scene(plan, tmp_path, capsys):
    verify.main([str(plan / "plan.blend"), str(plan / "july"), "-o", str(tmp_path / "out")])
    folder = tmp_path / "out"
    written = {"changes.csv", "changes.png", "units.toml", "verification.json", "verified.blend"}
    assert {path.name for path in folder.iterdir()} == written
    record = load_verification(folder / "verification.json")
    assert record.recording == "july"
    for pose in record.sensors:
        off = np.abs(np.array(pose.shift_m) - SHIFT)
        assert (off < np.array(pose.shift_half_width_m) + 0.01).all()
        assert 0.8 < pose.gain.value < 1.2
    kinds = {(change.kind, change.name) for change in record.changes if change.kind != "vehicle"}
    assert kinds == {("new", "Found 1"), ("gone", GONE)}
    told = capsys.readouterr().out
    assert re.search(rf"S1 is {np.linalg.norm(SHIFT):.2f} m from its planned position: 0\.3\d m east", told)
    assert f"{record.coverage.promised:.1%} were promised" in told
    assert {"os0_32_s1", "os0_32_s2"} < set(load_catalogue((folder / "units.toml",)))
    assert names(folder / "verified.blend") == names(plan / "plan.blend") - {GONE} | {"Found 1"}
    open_blend(folder / "verified.blend")
    at = [one.xyz for one in read_sensors(bpy.context.scene, load_catalogue())]
    assert np.allclose(at, np.array(list(PLANNED.values())) + SHIFT, atol=0.02)


@pytest.mark.slow
def test_a_corrected_scene_is_verified_again_without_changes(plan, tmp_path, capsys):
    verify.main([str(plan / "plan.blend"), str(plan / "july"), "-o", str(tmp_path / "one")])
    capsys.readouterr()
    verify.main([str(tmp_path / "one" / "verified.blend"), str(plan / "july"), "-o", str(tmp_path / "two")])
    told = capsys.readouterr().out
    assert "not in the plan" not in told
    assert "no longer there" not in told
    assert names(tmp_path / "two" / "verified.blend") == names(tmp_path / "one" / "verified.blend")


def no_sensors(folder):
    open_blend(folder / "plan.blend")
    bpy.data.batch_remove(bpy.data.collections["SEIP Sensors"].objects)
    save_blend(folder / "plan.blend")


def no_such_recording(folder):
    shutil.rmtree(folder / "july")


def other_names(folder):
    (folder / "july" / "S2").rename(folder / "july" / "north")


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (no_sensors, "no sensor"),
        (no_such_recording, "no such file or folder: .*july"),
        (other_names, "the plan has the sensors S1, S2, but the recording has north"),
    ],
)
def test_each_mistake_has_its_sentence_and_leaves_nothing(plan, tmp_path, spoil, words):
    own = tmp_path / "own"
    shutil.copytree(plan, own)
    spoil(own)
    with pytest.raises(SeipError, match=words):
        verify.main([str(own / "plan.blend"), str(own / "july"), "-o", str(tmp_path / "out")])
    assert not list((tmp_path / "out").glob("*"))
