"""Traffic and scans: the operators do what the batch command does, byte for byte."""

import re
import shutil
from pathlib import Path

from headless import simulate, traffic

import bpy
import numpy as np
import pytest

from seip_addon.core.sensing.scans.frame import Frame
from seip_addon.panel import traffic as panel
from seip_addon.panel.session import session
from seip_addon.panel.traffic import SEIP_OT_simulate_traffic
from tests.builders.drawn_layout import DrawnLayout
from tests.builders.osm_text import crossing
from tests.sumo_here import needs_sumo


@pytest.fixture
def placed(placed, small_scene):
    placed.seip.traffic.file = str(small_scene.parent / "small_traffic" / "run-1.npz")
    return placed


def files(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_traffic_is_loaded_animated_and_cleared(placed):
    assert bpy.ops.seip.load_traffic() == {"FINISHED"}
    objects = bpy.data.collections["SEIP Traffic"].objects
    assert placed.seip.traffic.loaded.startswith(f"{len(objects)} road users, 0 to ")
    assert bpy.ops.seip.clear_traffic() == {"FINISHED"}
    assert "SEIP Traffic" not in bpy.data.collections
    assert not placed.seip.traffic.loaded


def test_a_scan_at_a_time_of_a_run_is_the_frame_of_the_command(placed, tmp_path):
    blend, run, traffic = tmp_path / "placed.blend", tmp_path / "run", placed.seip.traffic
    traffic.seed = 7
    placed.frame_set(placed.render.fps)
    bpy.ops.seip.scan_frame()
    shown = session.of(placed).scan.frame
    bpy.ops.wm.save_as_mainfile(filepath=str(blend), copy=True)
    simulate.main([str(blend), "--traffic", traffic.file, "--duration", "1", "--seed", "7", "-o", str(run)])
    recorded = Frame.load(run / "frames" / "000005.npz")  # five in a second
    assert shown.points.tobytes() == recorded.points.tobytes()
    assert shown.labels.points.tolist() == recorded.labels.points.tolist()
    assert len(recorded.labels) > 0


def test_animated_objects_are_scanned_as_the_file_is(placed):
    bpy.ops.seip.load_traffic()
    placed.frame_set(480)
    bpy.ops.seip.scan_frame()
    from_file = session.of(placed).scan.frame
    placed.seip.traffic.file = ""
    placed.frame_start, placed.frame_end = 479, 481
    bpy.ops.seip.scan_frame()
    animated = session.of(placed).scan.frame
    assert len(animated.labels) == len(from_file.labels)
    assert np.allclose(np.sort(animated.labels.centre[:, 0]), np.sort(from_file.labels.centre[:, 0]), atol=0.01)


def test_each_mistake_has_its_sentence(placed):
    for file, words in (("/nowhere/run.npz", "there is no .*run.npz"), ("", "There is nothing to scan")):
        placed.seip.traffic.file = file
        with pytest.raises(RuntimeError, match=words):
            bpy.ops.seip.scan_frame()
    bpy.data.batch_remove(bpy.data.collections["SEIP Sensors"].objects)
    with pytest.raises(RuntimeError, match="There is no sensor in the scene"):
        bpy.ops.seip.scan_frame()


SCENES = Path(__file__).resolve().parents[2] / "scenes"


@pytest.fixture
def site(add_on, tmp_path):
    """The shipped junction with its map beside it, and a short simulation."""
    for suffix in (".blend", ".xodr"):
        shutil.copy(SCENES / f"junction{suffix}", tmp_path)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "junction.blend"))
    return short(bpy.context.scene)


def short(scene):
    request = scene.seip.simulation
    request.flow, request.pedestrians, request.duration, request.count = 450.0, 60.0, 5.0, 2
    return scene


def drawn():
    layout = DrawnLayout()
    panel.draw_simulation(layout, bpy.context)
    return layout


@needs_sumo
def test_runs_are_those_of_the_command_and_used_by_the_next_buttons(site, tmp_path):
    assert dict(drawn().properties)["map"]["placeholder"] == "junction.xodr"
    assert bpy.ops.seip.simulate_traffic() == {"FINISHED"}
    seip = site.seip
    assert seip.traffic.runs == "//seip-traffic/"
    assert seip.traffic.file == "//seip-traffic/run-1.npz"
    users = len(bpy.data.collections["SEIP Traffic"].objects)
    assert seip.traffic.loaded.startswith(f"{users} road users, 0 to 4.8 s")
    assert bpy.ops.seip.load_traffic() == {"FINISHED"}
    text = drawn().text
    assert "2 runs, " in text
    assert panel.USED in text
    traffic.main([
        str(SCENES / "junction.blend"), "--simulate", str(SCENES / "junction.xodr"), "--flow", "450",
        "--pedestrians", "60", "--duration", "5", "--seed", "2", "-o", str(tmp_path / "2.npz"),
    ])  # fmt: skip
    assert (tmp_path / "2.npz").read_bytes() == (tmp_path / "seip-traffic" / "run-2.npz").read_bytes()


@needs_sumo
def test_the_streets_of_an_extract_are_simulated_on(add_on, tmp_path):
    extract = crossing().write(tmp_path / "place.osm")
    assert bpy.ops.seip.choose_map(filepath=str(extract)) == {"FINISHED"}
    chosen = bpy.context.scene.seip.site
    chosen.junction, chosen.radius = chosen.junctions[0].name, 40.0
    assert bpy.ops.seip.build_site() == {"FINISHED"}
    scene = short(bpy.context.scene)
    assert scene.seip.simulation.map in bpy.data.texts
    scene.seip.simulation.folder = str(tmp_path / "panel")
    assert bpy.ops.seip.simulate_traffic() == {"FINISHED"}
    assert scene.seip.traffic.file == str(tmp_path / "panel" / "run-1.npz")


@needs_sumo
def test_a_map_of_another_place_is_refused_and_nothing_is_written(site, tmp_path):
    text = (SCENES / "corridor.xodr").read_text(encoding="utf-8")
    far = re.sub(r'(<geometry s="[^"]*" x=")([^"]*)', lambda found: f"{found[1]}{float(found[2]) + 5000.0}", text)
    assert far != text
    (tmp_path / "far.xodr").write_text(far, encoding="utf-8")
    site.seip.simulation.map = "//far.xodr"
    with pytest.raises(
        RuntimeError, match=r"^Error: far\.xodr has no road at this site: name the map that the site was built from\n$"
    ):
        bpy.ops.seip.simulate_traffic()
    assert not (tmp_path / "seip-traffic").exists()
    assert not site.seip.traffic.runs


@needs_sumo
def test_stopped_simulation_leaves_nothing(site, tmp_path):
    work = next(SEIP_OT_simulate_traffic.job(None, site))
    assert next(work).what == "simulating run 1 of 2"
    next(work)
    work.close()
    assert not (tmp_path / "seip-traffic").exists()
    assert "SEIP Traffic" not in bpy.data.collections
