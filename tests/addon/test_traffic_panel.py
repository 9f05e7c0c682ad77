"""Traffic and scans: the operators do what the batch command does, byte for byte."""

from headless import simulate

import bpy
import numpy as np
import pytest

from seip_addon.core.sensing.scans.frame import Frame
from seip_addon.panel.session import session


@pytest.fixture
def placed(junction, small_scene):
    scene = junction
    bpy.ops.seip.solve_placement()
    scene.seip.traffic.file = str(small_scene.parent / "small_traffic" / "run-1.npz")
    return scene


def files(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_traffic_is_loaded_animated_and_cleared(placed):
    assert bpy.ops.seip.load_traffic() == {"FINISHED"}
    objects = bpy.data.collections["SEIP Traffic"].objects
    assert placed.seip.traffic.loaded.startswith(f"{len(objects)} road users, 0 to ")
    assert bpy.ops.seip.clear_traffic() == {"FINISHED"}
    assert "SEIP Traffic" not in bpy.data.collections
    assert not placed.seip.traffic.loaded


@pytest.mark.slow
def test_a_dataset_is_that_of_the_batch_command(placed, tmp_path, small_scene):
    traffic = placed.seip.traffic
    traffic.whole, traffic.start, traffic.duration, traffic.rate, traffic.seed = False, 20.0, 0.2, 5.0, 7
    traffic.formats = {"kitti", "pcd"}
    traffic.split = "val"
    traffic.folder = str(tmp_path / "panel" / "run")
    assert bpy.ops.seip.write_dataset() == {"FINISHED"}
    blend = tmp_path / "placed.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend), copy=True)
    simulate.main(
        [
            *(
                str(blend),
                "--traffic",
                placed.seip.traffic.file,
                "-o",
                str(tmp_path / "batch" / "run"),
                "--start",
                "20",
            ),
            *("--duration", "0.2", "--rate", "5", "--seed", "7", "--format", "kitti", "pcd", "--split", "val"),
        ]
    )
    one, other = files(tmp_path / "panel"), files(tmp_path / "batch")
    assert one.keys() == other.keys()
    assert len(list((tmp_path / "panel" / "run" / "frames").iterdir())) == 2
    for name in one:
        assert one[name] == other[name], name


def test_a_scan_at_a_time_of_the_run_is_the_runs_frame(placed, tmp_path):
    traffic = placed.seip.traffic
    traffic.whole, traffic.start, traffic.duration, traffic.rate = False, 20.0, 1.0, 1.0
    traffic.folder = str(tmp_path / "run")
    bpy.ops.seip.write_dataset()
    placed.frame_set(21 * placed.render.fps)
    bpy.ops.seip.scan_frame()
    recorded, shown = Frame.load(tmp_path / "run" / "frames" / "000001.npz"), session.of(placed).scan.frame
    assert shown.points.tobytes() == recorded.points.tobytes()
    assert shown.labels.points.tolist() == recorded.labels.points.tolist()


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


def test_each_mistake_has_its_sentence(placed, tmp_path):
    traffic = placed.seip.traffic
    run, folder = traffic.file, str(tmp_path / "run")
    for file, output, words in (
        ("/nowhere/run.npz", folder, "there is no .*run.npz"),
        ("", folder, "There is nothing to scan"),
        (run, "", "name a folder"),
    ):
        traffic.file, traffic.folder = file, output
        with pytest.raises(RuntimeError, match=words):
            bpy.ops.seip.write_dataset()
    traffic.folder = folder
    bpy.data.batch_remove(bpy.data.collections["SEIP Sensors"].objects)
    with pytest.raises(RuntimeError, match="There is no sensor in the scene"):
        bpy.ops.seip.write_dataset()
    assert not (tmp_path / "run").exists()
