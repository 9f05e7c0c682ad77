"""The command that evaluates a placement by what a trained detector finds."""

import contextlib
import io
import json
import shutil

import numpy as np
import pytest

from seip_addon.core.sensing.traffic.trajectories import RoadUser, Trajectories
from tests.builders.small_junction import ORIGIN

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless import detect
from headless.detection.detector import SHIPPED_DETECTOR, Detector, TrainingRecord
from headless.detection.settings import NetworkSettings

from seip_addon.core.base.errors import SeipError
from seip_addon.scene.blend_file import save_blend
from seip_addon.scene.write import write_result
from tests.builders.scene_by_hand import make_scene
from tests.builders.small_junction import make_example


def car_and_bus(y, seconds=8.0) -> Trajectories:
    """Return a car that drives along +x, and one that stands."""
    times = np.arange(int(seconds * 5)) / 5
    count = len(times)
    moving = np.column_stack([-30 + 6 * times, np.full(count, y), np.zeros(count)])
    standing = np.tile([10.0 + y, -y, 0.0], (count, 1))
    return Trajectories(
        users=(RoadUser("moving", "car", 4.5, 1.8, 1.5), RoadUser("standing", "bus", 12.0, 2.5, 3.2)),
        origin=np.zeros(3),
        first=np.array([0, count, 2 * count]),
        time=np.concatenate([times, times]),
        position=np.concatenate([moving, standing]) + ORIGIN,
        yaw=np.zeros(2 * count),
        pitch=np.zeros(2 * count),
        speed=np.concatenate([np.full(count, 6.0), np.zeros(count)]),
        source=f"by hand, {y}",
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A placed scene, two runs of traffic and a detector that was trained on nothing."""
    folder = tmp_path_factory.mktemp("detect")
    example = make_example()
    write_result(make_scene(example.geometry), example.site, example.deployment)
    save_blend(folder / "placed.blend")
    car_and_bus(-3.5).save(folder / "first.npz")
    car_and_bus(3.5).save(folder / "second.npz")
    settings = NetworkSettings(width=8, blocks=(1, 1, 1))
    record = TrainingRecord(sensors=("vlp16",), sites=("Elsewhere",))
    Detector(settings, training_record=record).save(folder / "detector.pt")
    return folder


def arguments(folder, output, *runs, **changed):
    given = {"scene": folder / "placed.blend", "detector": folder / "detector.pt"} | changed
    traffic = [str(folder / run) for run in runs or ("first.npz", "second.npz")]
    named = ["--detector", str(given["detector"]), "--every", "2", "-o", str(folder / output)]
    return [str(given["scene"]), "--traffic", *traffic, *named]


@pytest.fixture(scope="module")
def printed(folder):
    """What is printed when both runs are detected, into the folder ``out``."""
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        detect.main(arguments(folder, "out"))
    return text.getvalue()


def test_figures_charts_and_detections_are_written(folder, printed):
    record = json.loads((folder / "out" / "detection.json").read_text(encoding="utf-8"))
    assert [run["name"] for run in record["traffic"]] == ["first", "second"]
    assert {"bev_0.7", "car_van_0.7", "truck_bus_0.7"} <= set(record["average_precision"])
    assert "pedestrian_0.5" not in record["average_precision"]  # there is none
    assert {"bev_0.7_moving", "bev_0.7_parked", "3d_0.7"} <= set(record["average_precision"])
    users = {name: figure["road_users"] for name, figure in record["average_precision"].items()}
    assert users["bev_0.7_moving"] + users["bev_0.7_parked"] == users["bev_0.7"]
    assert users["bev_0.7_parked"] == users["truck_bus_0.7"]  # the bus alone stands
    assert set(record["recall"]) == {"car", "bus"}
    assert sum(one["road_users"] for one in record["recall"].values()) == users["bev_0.7"]
    assert record["scans"]["rolling_shutter"] is True
    assert all(figure["interval"] is None for figure in record["average_precision"].values())
    assert any(line.startswith("2 test runs of traffic give no interval") for line in record["warnings"])
    frames = sum(run["frames"] for run in record["traffic"])
    for form in ("kitti", "openpcdet"):
        assert len(list((folder / "out" / form).glob("*.txt"))) == frames
    for chart in ("where.png", "errors.png", "precision_recall.png"):
        assert (folder / "out" / chart).read_bytes().startswith(b"\x89PNG")
    assert "bev_0.7: AP" in printed
    assert "with a score of" in printed
    assert any("trained on clouds of vlp16" in sentence for sentence in record["warnings"])


def test_the_shipped_detector_finds_the_car_and_the_bus(folder):
    options = ["--traffic", str(folder / "first.npz"), "--every", "2", "-o", str(folder / "shipped")]
    detect.main([str(folder / "placed.blend"), *options])
    record = json.loads((folder / "shipped" / "detection.json").read_text(encoding="utf-8"))
    assert record["average_precision"]["bev_0.5"]["average_precision"] > 0.5
    assert {"type1", "type2", "type3"} <= set(record["detector"]["experience"]["sensors"])
    assert SHIPPED_DETECTOR.stat().st_size < 4_000_000


@pytest.mark.usefixtures("printed")
def test_the_same_inputs_give_the_same_figures_and_nothing_of_an_earlier_longer_run_stays(folder):
    shutil.copytree(folder / "out", folder / "again")
    counts, figures = [], []
    for output in ("again", "new"):
        detect.main(arguments(folder, output, "first.npz"))
        figures.append((folder / output / "detection.json").read_bytes())
        counts.append({form: len(list((folder / output / form).glob("*.txt"))) for form in ("kitti", "openpcdet")})
    assert figures[0] == figures[1]
    assert counts[0] == counts[1]
    assert {form: len(list((folder / "out" / form).glob("*.txt"))) for form in counts[0]} == {
        form: 2 * count for form, count in counts[0].items()
    }


def test_mistakes_are_named(folder, tmp_path):
    broken = tmp_path / "broken.pt"
    broken.write_bytes(b"no detector")
    with pytest.raises(SeipError, match=r"broken\.pt"):
        detect.main(arguments(folder, "x", detector=broken))
    for every in ("0", "-1", "nan", "inf", "1e-9"):
        with pytest.raises(SeipError, match=rf"--every must be 0\.001 to 86,400 s, not {every}"):
            detect.main([*arguments(folder, "x"), "--every", every])
    example = make_example()
    make_scene(example.geometry)
    save_blend(tmp_path / "bare.blend")
    with pytest.raises(SeipError, match="no sensors"):
        detect.main(arguments(folder, "x", scene=tmp_path / "bare.blend"))
    far = car_and_bus(-3.5)
    far.position[:] += [5000.0, 0.0, 0.0]
    far.save(tmp_path / "far.npz")
    with pytest.raises(SeipError, match="traffic of another site: 100% of the vehicle positions of far"):
        detect.main(arguments(folder, "x", str(tmp_path / "far.npz")))
    assert not (folder / "x" / "detection.json").exists()
