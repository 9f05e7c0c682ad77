"""The command that detects road users in the recordings of real sensors."""

import csv
import json
import math
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")
pytest.importorskip("bpy")

from headless import detect, detect_recording
from headless.detection.confidence import Confidence
from headless.detection.detector import SHIPPED_DETECTOR, Detector
from headless.detection.settings import CLASS_CATEGORIES

from PIL import Image

from seip_addon.core.base.errors import SeipError
from seip_addon.core.geometry.geo_reference import GeoReference
from seip_addon.core.output.datasets.formats import CLASSES
from tests.builders.scanned_street import ground_mesh, mounted, street_meshes, street_record, surface_of

SENSOR = mounted("os1_32_rev7", (-16.0, -14.0, 4.5))
SWEEPS = 6
CARS = [
    [(-18.0 + 5 * n, -2.0, 4.5, 1.8, 1.5, 0.0), (2.0, 16.0 - 5 * n, 4.5, 1.8, 1.5, -math.pi / 2)] for n in range(SWEEPS)
]


def away(x, y):
    """Return the distance of a place from the sensor."""
    return math.hypot(x - SENSOR.xyz[0], y - SENSOR.xyz[1])


@pytest.fixture(scope="module")
def record():
    return street_record(surface_of((ground_mesh(), *street_meshes())), SENSOR, SWEEPS, 0, CARS)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, record):
    """A recording with poses and labels of its cars."""
    folder = tmp_path_factory.mktemp("recording")
    (folder / "S1").mkdir()
    for number in range(SWEEPS):
        sweep = record.sweep(number)
        columns = dict(zip("xyz", sweep.points.T, strict=True))
        np.savez(folder / "S1" / f"{number}.npz", **columns, intensity=sweep.intensity * 255)
    (folder / "S1" / "timestamps.txt").write_text("\n".join(str(number / 2) for number in range(SWEEPS)))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = SENSOR.orientation, SENSOR.xyz
    (folder / "poses.json").write_text(json.dumps({"S1": pose.tolist()}))
    (folder / "labels").mkdir()
    for number, cars in enumerate(CARS):
        rows = [f"{x} {y} {0.02 * x + h / 2} {a} {b} {h} {yaw} Car\n" for x, y, a, b, h, yaw in cars]
        (folder / "labels" / f"{number}.txt").write_text("".join(rows))
    return folder


def arguments(folder, output, *more, sensor=("os1_32_rev7",), recording=None):
    named = ["--sensor", *sensor] if sensor else []
    given = ["--poses", str(folder / "poses.json"), "--radius", "30"]
    return [str(recording or folder / "S1"), *named, *given, *more, "-o", str(output)]


@pytest.fixture(scope="module")
def results(folder, tmp_path_factory):
    output = tmp_path_factory.mktemp("results") / "out"
    detect.main(arguments(folder, output, "--labels", str(folder / "labels")))
    return output


def test_detections_pictures_and_figures_are_written(results):
    for part, suffix in (("kitti", "txt"), ("openpcdet", "txt"), ("frames", "png")):
        names = [f"{number:06d}.{suffix}" for number in range(SWEEPS)]
        assert sorted(path.name for path in (results / part).iterdir()) == names
    with Image.open(results / "frames" / "000000.png") as picture:
        assert picture.size == (1080, 1080)
    record = json.loads((results / "detection.json").read_text(encoding="utf-8"))
    assert record["frames"] == SWEEPS
    (sensor,) = record["sensors"]
    assert (sensor["id"], sensor["sensor"]) == ("S1", "os1_32_rev7")
    assert sensor["local_m"] == pytest.approx(SENSOR.xyz.tolist())
    assert sensor["intensity_scale"] == pytest.approx(1 / 255, rel=0.1)
    assert any("6 sweeps over 2 s are few" in sentence for sentence in record["warnings"])


def test_the_table_lists_each_detection_with_its_confidence_time_and_box(results):
    with (results / "detections.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == [
        *(
            "frame",
            "time_s",
            "category",
            "confidence",
            "x_m",
            "y_m",
            "z_m",
            "length_m",
            "width_m",
            "height_m",
            "yaw_deg",
        ),
        "apart",
    ]
    known = Confidence.of_detector(SHIPPED_DETECTOR, Detector.load(SHIPPED_DETECTOR))
    assert known.recordings
    class_of = {CLASSES[one]: name for name, group in CLASS_CATEGORIES.items() for one in group}
    expected = []
    for number in range(SWEEPS):
        lines = (results / "openpcdet" / f"{number:06d}.txt").read_text(encoding="utf-8").splitlines()
        for line in lines:
            *box, name, score = line.split()
            (sure,) = known.of_class(class_of[name], np.array([float(score)]))
            if sure >= 0.5:
                expected.append((number, number / 2, sure, *map(float, box)))
    assert len(rows) == len(expected) >= SWEEPS
    for row, (number, time, sure, x, y, z, length, width, height, yaw) in zip(rows, expected, strict=True):
        assert (int(row["frame"]), float(row["time_s"])) == (number, time)
        assert float(row["confidence"]) == pytest.approx(sure, abs=6e-4)
        sizes = [float(row[name]) for name in ("x_m", "y_m", "z_m", "length_m", "width_m", "height_m")]
        assert sizes == pytest.approx([x, y, z, length, width, height], abs=6e-4)
        assert float(row["yaw_deg"]) == pytest.approx(math.degrees(yaw), abs=0.06)


def test_the_table_has_geographic_coordinates_if_the_map_names_its_projection(tmp_path):
    boxes = np.array([[10.0, 20.0, 1.0, 4.0, 2.0, 1.5, 0.0], [0.0, 0.0, 1.0, 4.0, 2.0, 1.5, 0.0]])
    detected = SimpleNamespace(boxes=boxes, score=np.array([0.9, 0.2]), category=np.array(["car", "car"]))
    results = [SimpleNamespace(detected=detected, time=0.5)]
    reference = GeoReference("+proj=utm +zone=33 +datum=WGS84 +units=m")
    geometry = SimpleNamespace(geo_reference=reference, origin=np.array([392_000.0, 5_820_000.0, 30.0]))
    beside = [np.array([True, False])]
    assert detect_recording._save_table(tmp_path / "table.csv", results, beside, geometry) == 1  # noqa: SLF001
    with (tmp_path / "table.csv").open(encoding="utf-8", newline="") as file:
        (row,) = csv.DictReader(file)
    assert row["apart"] == "yes"
    ((longitude, latitude, _),) = reference.geographic(boxes[:1, :3] + geometry.origin)
    assert (float(row["longitude"]), float(row["latitude"])) == pytest.approx((longitude, latitude), abs=1e-7)


def test_a_run_that_was_stopped_goes_on_and_gives_the_same_bytes(folder, results, tmp_path, monkeypatch):
    output, calls = tmp_path / "out", []

    def stopped(*inputs):
        calls.append(inputs)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return found(*inputs)

    def content(where):
        files = [path for path in where.rglob("*") if path.is_file() and path.name != "detection.json"]
        return {path.relative_to(where): path.read_bytes() for path in files}

    found = detect_recording.detect
    monkeypatch.setattr(detect_recording, "detect", stopped)
    with pytest.raises(KeyboardInterrupt):
        detect.main(arguments(folder, output, "--labels", str(folder / "labels")))
    detect.main(arguments(folder, output, "--labels", str(folder / "labels")))
    assert len(calls) == 3 + SWEEPS - 2
    assert content(output) == content(results)
    detect.main(arguments(folder, output))  # without labels other results
    assert len(calls) == 3 + SWEEPS - 2 + SWEEPS
    assert len(list((output / "stored").iterdir())) == SWEEPS


def test_the_cars_are_found_where_they_are(results):
    with (results / "detections.csv").open(encoding="utf-8", newline="") as file:
        rows = [(int(row["frame"]), float(row["x_m"]), float(row["y_m"])) for row in csv.DictReader(file)]
    cars = [(number, x, y) for number, present in enumerate(CARS) for x, y, *_ in present if away(x, y) < 25]
    near = [min((math.hypot(x - a, y - b) for n, a, b in rows if n == number), default=99.0) for number, x, y in cars]
    assert np.mean(np.array(near) < 1.0) > 0.8


def test_labels_give_average_precision(results):
    record = json.loads((results / "detection.json").read_text(encoding="utf-8"))
    found = record["average_precision"]["bev_0.7"]
    inside = sum(away(x, y) < 29.9 for present in CARS for x, y, *_ in present)
    assert inside - 1 <= found["road_users"] <= inside
    assert found["average_precision"] > 0.3
    listed = record["listed"]
    assert (listed["confidence"], listed["fewest_returns"]) == (0.5, 10)
    assert 0 < listed["road_users"] <= found["road_users"]
    assert listed["found"] > 0.7
    with (results / "detections.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["category"] in {"car", "truck"}]
    hits = round(listed["found"] * listed["road_users"])
    assert 0 <= listed["false_per_frame"] * SWEEPS <= len(rows) - hits
    for chart in ("where.png", "errors.png", "precision_recall.png"):
        assert (results / chart).read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("words", "more"),
    [
        (r"name the sensor that made the recording, as --sensor os1_128", {"sensor": ()}),
        (r"--sensor names no model for S1: add S1=KEY", {"sensor": ("S2=os1_32_rev7",)}),
        (r"but VLP-16 \(Puck\) has 16 channels", {"sensor": ("vlp16",)}),
    ],
)
def test_wrong_sensors_are_refused_before_anything_is_written(folder, tmp_path, words, more):
    with pytest.raises(SeipError, match=words):
        detect.main(arguments(folder, tmp_path / "out", **more))
    assert not [path for path in (tmp_path / "out").glob("**/*") if path.is_file() and not path.name.startswith(".")]


def test_labels_without_a_vehicle_in_the_region_are_refused_before_anything_is_written(folder, tmp_path):
    (tmp_path / "labels").mkdir()
    for number in range(SWEEPS):
        (tmp_path / "labels" / f"{number}.txt").write_text("0 0 1 1 1 2 0 Pedestrian\n500 0 1 4 2 2 0 Car\n")
    with pytest.raises(SeipError, match=r"has a car or van or truck or bus in the region"):
        detect.main(arguments(folder, tmp_path / "out", "--labels", str(tmp_path / "labels")))
    assert not [path for path in (tmp_path / "out").glob("**/*") if path.is_file() and not path.name.startswith(".")]
