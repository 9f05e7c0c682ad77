"""Verification from the panel: what it finds in a simulated recording, writes, and adds to the scene."""

import json
import re
import shutil
from dataclasses import replace

import bpy
import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.output.datasets.formats import POINT_TYPE, encode
from seip_addon.core.output.results.verification_record import load_verification
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scans.simulation import ScanSettings, prepare
from seip_addon.core.sensing.scans.static_scene import static_scene
from seip_addon.core.sensing.traffic.bodies import fitted_body
from seip_addon.core.site.scene_geometry import Mesh
from seip_addon.core.workflows.verifying import verify
from seip_addon.panel import verification as panel
from seip_addon.panel.session import session
from seip_addon.panel.verification import SEIP_OT_verify
from seip_addon.scene import contract
from seip_addon.scene.read import read_scene
from seip_addon.scene.sensors import read_sensors
from tests.builders.drawn_layout import DrawnLayout
from tests.builders.small_junction import box_triangles
from tests.builders.small_scene import make_run

EVERY = 1.2  # seconds between sweeps


def save_site_recording(
    folder,
    geometry,
    sensors,
    traffic,
    *,
    sweeps=20,
    seed=0,
):
    """Write sweeps of sensors in their own axes, a folder of PCD files for each; traffic is in local axes."""
    bodies = [fitted_body(user) for user in traffic.users]
    static = static_scene(geometry, sensors)
    simulation = finish(prepare(static, sensors, traffic, bodies, ScanSettings(seed)))
    for number in range(sweeps):
        frame = simulation.frame(number, EVERY * number)
        for row, sensor in enumerate(sensors):
            own = frame.sensor == row
            points = np.column_stack([(frame.points[own] - sensor.xyz) @ sensor.orientation, frame.intensity[own]])
            path = folder / sensor.label / f"{number:06d}.pcd"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(encode(np.ascontiguousarray(points.astype("<f4")).view(POINT_TYPE)[:, 0]))
    for sensor in sensors:
        times = "\n".join(str(EVERY * number) for number in range(sweeps))
        (folder / sensor.label / "timestamps.txt").write_text(times, encoding="utf-8")
    return folder


def changed(geometry, gone, new):
    """Return a site without one of its occluders and with others."""
    others = tuple(mesh for mesh in geometry.occluders if mesh.name != gone)
    assert len(others) == len(geometry.occluders) - 1
    return replace(geometry, occluders=(*others, *new))


SHIFT = np.array([0.3, -0.2, 0.15])
KIOSK = Mesh("kiosk", box_triangles((9.0, -13.0, 0.0), (11.0, -11.5, 3.0)))
GONE = "hoarding"
HOARDING = Mesh(GONE, box_triangles((16.0, 11.0, 0.0), (22.0, 11.3, 3.0)))


def put_hoarding(scene):
    mesh = bpy.data.meshes.new(GONE)
    corners = HOARDING.triangles.reshape(-1, 3)
    mesh.from_pydata(corners.tolist(), [], np.arange(len(corners)).reshape(-1, 3).tolist())
    contract.find(scene, contract.OCCLUDERS).objects.link(bpy.data.objects.new(GONE, mesh))


def put_sensors(scene):
    sensors = contract.find_or_make(scene, contract.SENSORS)
    for label, at in (("S1", (9.5, 9.5, 6.0)), ("S2", (-9.5, -9.5, 6.0))):
        empty = bpy.data.objects.new(label, None)
        empty["seip_sensor"], empty["seip_label"], empty.location = "os0_32", label, at
        sensors.objects.link(empty)
    bpy.context.view_layer.update()
    return read_sensors(scene, load_catalogue())


@pytest.fixture(scope="module")
def recording(small_scene, tmp_path_factory):
    """Sweeps of two sensors off their plan, at the junction with a kiosk more and a building less."""
    bpy.ops.wm.open_mainfile(filepath=str(small_scene))
    put_hoarding(bpy.context.scene)
    geometry = read_scene(bpy.context.scene).geometry
    planned = put_sensors(bpy.context.scene)
    true = [replace(one, xyz=one.xyz + SHIFT) for one in planned]
    traffic = make_run(7, 30.0).moved_to(geometry.origin)
    folder = tmp_path_factory.mktemp("recorded") / "july"
    return save_site_recording(folder, changed(geometry, GONE, [KIOSK]), true, traffic)


@pytest.fixture
def placed(junction, recording, tmp_path):
    put_hoarding(junction)
    put_sensors(junction)
    junction.seip.result.folder = str(tmp_path / "out")
    junction.seip.verification.recording = str(recording)
    return junction


@pytest.fixture(scope="module")
def computed():
    """The verification of `placed`, computed once: many tests start from it, and it takes seconds."""
    return []


@pytest.fixture
def verified(placed, computed, monkeypatch):
    def remembered(*given, **named):
        if not computed:
            computed.append((yield from verify(*given, **named)))
        return computed[0]

    with monkeypatch.context() as within:
        within.setattr(panel, "verify", remembered)
        assert bpy.ops.seip.verify() == {"FINISHED"}
    return placed


def drawn():
    layout = DrawnLayout()
    panel.draw(layout, bpy.context)
    return layout


def names(scene):
    return {mesh.name for mesh in read_scene(scene).geometry.occluders}


def test_the_panel_tells_poses_changes_and_coverage(verified, tmp_path):
    folder = tmp_path / "out" / "verification"
    written = {"changes.csv", "changes.png", "units.toml", "verification.json"}
    assert {path.name for path in folder.iterdir()} == written
    record = load_verification(folder / "verification.json")
    for pose in record.sensors:
        off = np.abs(np.array(pose.shift_m) - SHIFT)
        assert (off < np.array(pose.shift_half_width_m) + 0.01).all()
    kinds = {(change.kind, change.name) for change in record.changes if change.kind != "vehicle"}
    assert kinds == {("new", "Found 1"), ("gone", GONE)}
    text = drawn().text
    off = np.linalg.norm(SHIFT)
    assert re.search(rf"S1 by {off:.2f} m and 0\.\d°, S2 by {off:.2f} m", text)
    assert f"1 object is not in the scene (Found 1); 1 object is no longer there ({GONE})." in text
    assert f"{record.coverage.promised:.1%} were promised" in text
    assert [name for name, _ in drawn().operators] == ["seip.verify", "seip.correct_scene", "wm.path_open"]


@pytest.mark.slow
def test_the_scene_is_corrected_once_and_verified_again_without_changes(verified):
    before = names(verified)
    assert bpy.ops.seip.correct_scene() == {"FINISHED"}
    assert names(verified) == before - {GONE} | {"Found 1"}
    assert not bpy.ops.seip.correct_scene.poll()
    assert panel.CHANGED in drawn().text
    at = [one.xyz for one in read_sensors(verified, load_catalogue())]
    assert np.allclose(at, [np.array((9.5, 9.5, 6.0)) + SHIFT, np.array((-9.5, -9.5, 6.0)) + SHIFT], atol=0.02)
    assert bpy.ops.seip.verify() == {"FINISHED"}
    assert "Nothing has changed that the sensors see." in drawn().text
    assert bpy.ops.seip.correct_scene() == {"FINISHED"}
    assert names(verified) == before - {GONE} | {"Found 1"}


def test_a_moved_object_makes_the_verification_old(verified):
    assert panel.CHANGED not in drawn().text
    bpy.data.objects["building 0"].location.x += 1.0
    bpy.context.view_layer.update()
    assert panel.CHANGED in drawn().text
    with pytest.raises(RuntimeError, match="The scene has changed since"):
        bpy.ops.seip.correct_scene()


def test_stopped_work_leaves_nothing(placed, tmp_path):
    operator = SEIP_OT_verify
    steps = next(operator.job(None, placed))
    for _ in range(25):
        next(steps)
    steps.close()
    assert not (tmp_path / "out").exists()
    assert session.of(placed).verification is None


def test_a_recording_of_other_sensors_is_refused(placed, tmp_path):
    shutil.copytree(placed.seip.verification.recording, tmp_path / "other")
    (tmp_path / "other" / "S2").rename(tmp_path / "other" / "north")
    placed.seip.verification.recording = str(tmp_path / "other")
    with pytest.raises(RuntimeError, match="the plan has the sensors S1, S2, but the recording has north"):
        bpy.ops.seip.verify()
    assert not (tmp_path / "out").exists()
    assert session.of(placed).verification is None


def test_a_saved_file_keeps_what_was_found(verified, tmp_path):
    found = panel.sentences_of(verified)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "site.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "site.blend"))
    assert panel.sentences_of(bpy.context.scene) == found
    assert len(found) == 3
    text = drawn().text
    assert all(sentence in text for sentence in (*found, panel.NOT_VERIFIED))
    assert panel.picture_of(bpy.context.scene).is_file()
    bpy.context.scene.seip.result.folder = ""
    assert panel.picture_of(bpy.context.scene) is None
    assert "wm.path_open" not in dict(drawn().operators)
    assert not bpy.ops.seip.correct_scene.poll()


def test_the_units_are_in_a_catalogue(verified, tmp_path):
    models = load_catalogue((tmp_path / "out" / "verification" / "units.toml",))
    assert {"os0_32_s1", "os0_32_s2"} < set(models)
    record = json.loads((tmp_path / "out" / "verification" / "verification.json").read_text(encoding="utf-8"))
    assert record["recording"] == "july"
    assert 0.8 < record["sensors"][0]["gain"]["value"] < 1.2
