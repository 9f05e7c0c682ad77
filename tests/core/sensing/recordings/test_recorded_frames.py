"""Frames of recordings: intensities, foreground, ground and labels as in simulated scans."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.recordings.box_labels import BoxLabels
from seip_addon.core.sensing.recordings.recorded_frames import RecordedScene, prepare_frames
from seip_addon.core.sensing.recordings.recording import Recording
from seip_addon.core.sensing.scans.frame import STATIC_INSTANCE
from tests.builders.scan_frames import rotation
from tests.builders.scanned_street import box_mesh, ground_mesh, mounted, street_meshes, street_record, surface_of

SENSORS = (mounted("vlp16"), mounted("vlp16", (10.0, 8.0, 5.0), 1.2, "S2"))


def pose_of(sensor):
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = sensor.orientation, sensor.xyz
    return pose


POSES = {sensor.label: pose_of(sensor) for sensor in SENSORS}
MODELS = {sensor.label: sensor.model for sensor in SENSORS}


@pytest.fixture(scope="module")
def records():
    surface = surface_of((ground_mesh(), *street_meshes()))
    return tuple(street_record(surface, sensor, 10, seed, 3) for seed, sensor in enumerate(SENSORS))


def prepared(records, poses=POSES, **how):
    return finish(prepare_frames(Recording("street", tuple(records)), MODELS, poses, **{"radius": 40.0} | how))


def test_points_intensities_and_sensors_are_those_of_the_sweeps(records):
    frames = prepared(records)
    assert len(frames) == 10
    frame = frames.frame(4)
    assert frame.time == frames.time(4) == 2.0
    for number, (sensor, record) in enumerate(zip(SENSORS, records, strict=True)):
        own = frame.sensor == number
        expected = record.sweep(4).points.astype(np.float64) @ sensor.orientation.T + sensor.xyz
        assert np.allclose(frame.points[own], expected, atol=1e-4)
    assert (frame.instance == STATIC_INSTANCE).all()
    assert not len(frame.labels.user)


def test_the_ground_is_that_of_the_street(records):
    frames = prepared(records)
    random = np.random.default_rng(0)
    xy = random.uniform(-25, 25, (2000, 2))
    in_the_open = (np.abs(xy) < 11).any(axis=1)  # outside the buildings
    error = frames.ground.at(xy[in_the_open]) - 0.02 * xy[in_the_open, 0]
    assert np.quantile(np.abs(error), 0.95) < 0.1


def test_vehicles_are_foreground_and_the_street_is_not():
    surface = surface_of((ground_mesh(), *street_meshes()))
    (sensor, _), found, false, vehicles, static = SENSORS, 0, 0, 0, 0
    record = street_record(surface, sensor, 20, 5, 4)
    frames = finish(prepare_frames(Recording("street", (record,)), MODELS, POSES, radius=40.0))
    for number in range(20):
        frame = frames.frame(number)
        x, y, z = frame.points.T
        # Vehicles are within 4.5 m of the axes, and higher above the street than its noise; nothing else is there.
        on_vehicle = (np.minimum(np.abs(x), np.abs(y)) < 5.5) & (z - 0.02 * x > 0.3) & (z - 0.02 * x < 1.6)
        on_vehicle &= np.hypot(x, y) < 35
        on_street = z - 0.02 * x < 0.1
        found, vehicles = found + (frame.foreground & on_vehicle).sum(), vehicles + on_vehicle.sum()
        false, static = false + (frame.foreground & on_street).sum(), static + on_street.sum()
    assert vehicles > 1000
    assert found / vehicles > 0.95
    assert false / static < 0.005


def test_a_vehicle_that_always_stands_is_foreground_in_front_of_a_scene():
    """The recording alone cannot tell a parked van from a wall; a scene with a road can, and it corrects the pose."""
    street, sensor = (ground_mesh(), *street_meshes()), mounted("os1_32_rev7")
    van = box_mesh("van", 0.0, -14.0, 5.0, 2.0, 2.2)
    kiosk = box_mesh("kiosk", -14.0, 3.0, 3.0, 3.0, 3.0)  # beside the road
    record = street_record(surface_of((*street, van, kiosk)), sensor, 10)
    planned = pose_of(replace(sensor, xyz=sensor.xyz + np.array([0.3, -0.2, 0.1])))

    def road(xy):
        return np.where(np.abs(xy[:, 0]) < 6, 0.02 * xy[:, 0], np.nan)

    scene = RecordedScene(surface_of(street), road, shapely.box(-20, -30, 20, 10))
    one = Recording("S1", (record,))
    with_scene, alone = (
        finish(prepare_frames(one, {"S1": sensor.model}, {"S1": pose}, radius=30.0, scene=known))
        for known, pose in ((scene, planned), (None, pose_of(sensor)))
    )
    assert with_scene.region.equals(scene.region)
    assert with_scene.sensors[0].mounted.xyz == pytest.approx(sensor.xyz, abs=0.01)
    for frames, share in ((with_scene, (0.95, 1.0)), (alone, (0.0, 0.01))):
        frame = frames.frame(5)
        x, y, z = frame.points.T
        on_van = (np.abs(x) < 2.6) & (np.abs(y + 14.0) < 1.1) & (z > 0.4)
        on_kiosk = (np.abs(x + 14.0) < 1.6) & (np.abs(y - 3.0) < 1.6) & (z > 0.2)
        assert min(on_van.sum(), on_kiosk.sum()) > 50
        assert share[0] <= frame.foreground[on_van].mean() <= share[1]
        assert frame.foreground[on_kiosk].mean() < 0.01


def test_one_sensor_without_a_pose_is_levelled_above_the_ground():
    tilt = rotation(0.0, math.radians(10.0))
    sensor = mounted("os1_32_rev7")
    sensor = replace(sensor, orientation=sensor.orientation @ tilt)
    record = street_record(surface_of((ground_mesh(0.0), *street_meshes())), sensor, 8)
    frames = finish(prepare_frames(Recording("S1", (record,)), {"S1": sensor.model}, {}, radius=30.0))
    (found,) = frames.sensors
    assert found.mounted.xyz == pytest.approx([0.0, 0.0, 6.0], abs=0.05)
    up = found.mounted.orientation.T @ [0, 0, 1]
    assert up @ (sensor.orientation.T @ [0, 0, 1]) > math.cos(math.radians(0.3))
    assert frames.region.bounds == pytest.approx((-30, -30, 30, 30), abs=1e-6)


def test_points_in_a_labelled_box_are_returns_from_it(records):
    boxes = np.array([[24.0, 22.0, 4.5, 14.0, 12.0, 10.0, 0.1], [0.0, 0.0, 30.0, 4.0, 2.0, 1.0, 1.0]])
    labels = BoxLabels(boxes, np.array(["truck", "car"], dtype=np.str_))
    frame = prepared(records).frame(2, labels)
    offset = frame.points - boxes[0, :3]
    local = offset @ rotation(0.1)
    expected = (np.abs(local) <= boxes[0, 3:6] / 2).all(axis=1)
    assert 0 < expected.sum() < len(expected)
    assert ((frame.instance == 0) == expected).mean() > 0.9999  # single precision at faces
    assert not (frame.instance == 1).any()
    assert frame.labels.points[0].tolist() == [int(((frame.instance == 0) & (frame.sensor == n)).sum()) for n in (0, 1)]
    assert frame.labels.inside.tolist() == [True, True]
    assert frame.labels.category.tolist() == ["truck", "car"]
