"""Traffic and scans: the operators do what the batch command does, byte for byte."""

import json
import re

from headless import simulate

import bpy
import numpy as np
import pytest

from seip_addon import live_scan, traffic_coverage
from seip_addon.core.choosing.robustness.traffic_instants import obstacles_of
from seip_addon.core.choosing.robustness.visibility_in_traffic import visibility_in_traffic
from seip_addon.core.output.results.placement_file import load_placement
from seip_addon.core.progress import finish
from seip_addon.core.sensing.scans.frame import Frame
from seip_addon.core.workflows.survey import surroundings
from seip_addon.panels import traffic as traffic_panel
from seip_addon.scene.write import ASPECT, SEEN_BY, coverage_of, write_result
from seip_addon.session import session
from seip_addon.viewport import overlays
from seip_addon.viewport.point_cloud import NAME as CLOUD
from tests.builders.drawn_layout import DrawnLayout
from tests.builders.scene_by_hand import make_scene
from tests.builders.small_junction import ORIGIN, make_example


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
def test_what_traffic_leaves_of_a_placement_stands_with_it(placed, tmp_path):
    assert not bpy.ops.seip.try_in_traffic.poll()
    bpy.ops.seip.load_traffic()
    before = json.loads(placed.seip.result.record)["notes"]
    for _ in range(2):
        assert bpy.ops.seip.try_in_traffic() == {"FINISHED"}
        notes = json.loads(placed.seip.result.record)["notes"]
        assert notes[:-1] == before
        assert re.fullmatch(
            r"in traffic \(\d+ road users at a time\) this placement sees [\d.]+% \[too few data for an interval\] of "
            r"the road on average over time, [\d.]+% when it is empty",
            notes[-1],
        )
    coverage = json.loads(placed.seip.result.record)["coverage"]["whole"]
    assert notes[-1].endswith(f"{coverage:.2%} when it is empty")
    placed.seip.result.folder = str(tmp_path)
    bpy.ops.seip.export_result()
    assert list(load_placement(tmp_path / "placement.json").notes) == notes


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
    recorded, shown = Frame.load(tmp_path / "run" / "frames" / "000001.npz"), session.scan_of(placed).frame
    assert shown.points.tobytes() == recorded.points.tobytes()
    assert shown.labels.points.tolist() == recorded.labels.points.tolist()


def test_the_cloud_is_drawn_in_the_colours_asked_for(placed):
    bpy.ops.seip.scan_frame()
    frame = session.scan_of(placed).frame
    seen = []
    for by in ("sensor", "intensity", "instance"):
        placed.seip.view.cloud_colour = by
        (layer,) = overlays.find(placed, CLOUD).layers
        assert layer.colours.shape == (len(frame), 4)
        assert layer.colours.dtype == np.float32
        seen.append(layer.colours)
    assert not np.array_equal(seen[0], seen[1])
    assert len(np.unique(seen[0], axis=0)) == 2
    bpy.ops.seip.hide_scan()
    assert overlays.find(placed, CLOUD) is None


def test_other_traffic_ends_the_scan_of_the_earlier(placed, small_scene):
    bpy.ops.seip.load_traffic()
    bpy.ops.seip.scan_frame()
    placed.seip.traffic.follow = True
    placed.seip.traffic.file = str(small_scene.parent / "small_traffic" / "run-2.npz")
    bpy.ops.seip.load_traffic()
    assert session.scan_of(placed) is None
    assert overlays.find(placed, CLOUD) is None
    placed.frame_set(300)
    assert session.scan_of(placed) is None


def test_animated_objects_are_scanned_as_the_file_is(placed):
    bpy.ops.seip.load_traffic()
    placed.frame_set(480)
    bpy.ops.seip.scan_frame()
    from_file = session.scan_of(placed).frame
    placed.seip.traffic.file = ""
    placed.frame_start, placed.frame_end = 479, 481
    bpy.ops.seip.scan_frame()
    animated = session.scan_of(placed).frame
    assert len(animated.labels) == len(from_file.labels)
    assert np.allclose(np.sort(animated.labels.centre[:, 0]), np.sort(from_file.labels.centre[:, 0]), atol=0.01)


def test_following_scans_at_each_frame_and_leaves_no_handler(placed):
    before = len(bpy.app.handlers.frame_change_post)
    bpy.ops.seip.scan_frame()
    placed.seip.traffic.follow = True
    assert len(bpy.app.handlers.frame_change_post) == before + 1
    placed.frame_set(480)
    assert session.scan_of(placed).frame.time == pytest.approx(480 / placed.render.fps)
    placed.seip.traffic.follow = False
    placed.frame_set(490)
    assert session.scan_of(placed).frame.time == pytest.approx(480 / placed.render.fps)
    assert len(bpy.app.handlers.frame_change_post) == before


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda scene: setattr(scene.seip.traffic, "file", "/nowhere/run.npz"), "there is no .*run.npz"),
        (lambda scene: setattr(scene.seip.traffic, "file", ""), "There is nothing to scan: name a traffic file"),
        (
            lambda scene: bpy.data.batch_remove(bpy.data.collections["SEIP Sensors"].objects),
            "There is no sensor to scan with",
        ),
        (lambda scene: setattr(scene.seip.traffic, "folder", ""), "name a folder"),
    ],
)
def test_each_mistake_has_its_sentence(placed, tmp_path, wrong, words):
    placed.seip.traffic.folder = str(tmp_path / "run")
    wrong(placed)
    with pytest.raises(RuntimeError, match=words):
        bpy.ops.seip.write_dataset()
    assert not (tmp_path / "run").exists()


def test_a_folder_beside_a_file_that_was_never_saved_has_its_sentence(add_on, small_scene):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = make_scene(make_example().geometry)
    write_result(scene, make_example().site, make_example().deployment)
    scene.seip.traffic.file = str(small_scene.parent / "small_traffic" / "run-1.npz")
    with pytest.raises(RuntimeError, match="the file has not been saved: save it first"):
        bpy.ops.seip.write_dataset()


def test_a_second_scan_of_the_same_scene_needs_no_preparation(placed):
    bpy.ops.seip.scan_frame()
    first = session.scan_of(placed).simulation
    placed.frame_set(300)
    bpy.ops.seip.scan_frame()
    assert session.scan_of(placed).simulation is first
    empty = next(obj for obj in bpy.data.collections["SEIP Sensors"].objects if obj.type == "EMPTY")
    empty.location.z += 1.0
    bpy.ops.seip.scan_frame()
    assert session.scan_of(placed).simulation is not first


def test_floating_car_data_are_put_on_the_road(placed, tmp_path):
    car = '<vehicle id="a" x="{}" y="{}" angle="90" type="car" speed="5"/>'
    lines = [
        f'<timestep time="{time}">{car.format(ORIGIN[0] + 5 * time - 20, ORIGIN[1] - 2.0)}</timestep>'
        for time in range(6)
    ]
    fcd = tmp_path / "run.fcd.xml"
    fcd.write_text(f"<fcd-export>{''.join(lines)}</fcd-export>", encoding="utf-8")
    placed.seip.traffic.file = str(fcd)
    assert bpy.ops.seip.load_traffic() == {"FINISHED"}
    assert placed.seip.traffic.loaded.startswith("1 road user, 0 to 5 s\n1 car")
    bpy.ops.seip.scan_frame()
    assert session.scan_of(placed).run.trajectories.source == "run.fcd.xml"


def shown_seen_by(scene):
    attribute = coverage_of(scene).data.attributes[SEEN_BY]
    counts = np.empty(len(attribute.data), dtype=np.int32)
    attribute.data.foreach_get("value", counts)
    return counts


def test_coverage_follows_the_timeline_and_is_that_of_the_empty_road_again(placed):
    empty, aspect = shown_seen_by(placed), coverage_of(placed)[ASPECT]
    with pytest.raises(RuntimeError, match="load the traffic first"):
        bpy.ops.seip.show_in_traffic()
    bpy.ops.seip.load_traffic()
    placed.frame_set(0)
    assert bpy.ops.seip.show_in_traffic() == {"FINISHED"}
    survey, solution = session.state_of(placed).placed()
    run = session.traffic[placed.session_uid].trajectories
    hidden = 0
    for frame in (0, 150, 300, 450):
        placed.frame_set(frame)
        traffic_coverage.update()  # as the timer does, which does not run without a window
        present = obstacles_of(run, run.at(live_scan.now(placed)))
        views = finish(visibility_in_traffic(surroundings(survey), solution.placement.chosen, [present]))
        assert shown_seen_by(placed).tolist() == views.seen(0).sum(axis=0).tolist()
        assert session.in_traffic.coverage == pytest.approx((shown_seen_by(placed) > 0).mean())
        hidden += int(((empty > 0) & (shown_seen_by(placed) == 0)).sum())
    assert hidden > 0
    layout = DrawnLayout()
    traffic_panel.draw(layout, bpy.context)
    assert "seip.show_in_traffic" in dict(layout.operators)
    assert bpy.ops.seip.show_in_traffic() == {"FINISHED"}
    assert session.in_traffic is None
    assert shown_seen_by(placed).tolist() == empty.tolist()
    assert coverage_of(placed)[ASPECT] == aspect


def test_coverage_in_traffic_of_another_placement_or_without_traffic_says_so(placed):
    bpy.ops.seip.load_traffic()
    bpy.ops.seip.show_in_traffic()
    own = session.traffic.pop(placed.session_uid)
    traffic_coverage.update()
    assert "load it again" in session.in_traffic.problem
    session.traffic[placed.session_uid] = own
    traffic_coverage.update()
    assert session.in_traffic.problem == ""
    placed.seip.result.record += " "
    traffic_coverage.update()
    assert "another placement" in session.in_traffic.problem
    bpy.ops.seip.show_in_traffic()
    assert session.in_traffic is None
