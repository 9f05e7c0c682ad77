"""The conversions of each format, against other ways to the same numbers."""

import math
from dataclasses import replace

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from seip_addon.core.output.datasets.formats import FORMATS, point_cloud_range, read_labels
from seip_addon.core.output.datasets.sample import make_sample
from tests.builders.scan_frames import make_frame, make_frames, make_run, rotation, write

angles = st.floats(-math.pi, math.pi)
places = st.tuples(*[st.floats(-500, 500)] * 3).map(np.array)
KITTI_COLUMNS = 15


@given(st.lists(st.tuples(places, st.tuples(*[st.floats(0.1, 20)] * 3).map(np.array), angles), max_size=6))
def test_the_range_holds_every_box_in_whole_pillars_and_voxels(found):
    boxes = np.array([[*place, *size, yaw] for place, size, yaw in found]).reshape(-1, 7)
    extent = point_cloud_range(boxes)
    for place, size, yaw in found:
        signs = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T
        corners = place + (signs * size) @ rotation(yaw).T
        assert (corners > extent[:3]).all()
        assert (corners < extent[3:]).all()
    span = extent[3:] - extent[:3]
    for pillar in (0.1, 0.2, 0.4):
        cells = span[:2] / pillar
        assert cells == pytest.approx(np.round(cells))
        assert (np.round(cells) % 16 == 0).all()
    assert span[2] / 40 / 0.05 == pytest.approx(round(span[2] / 40 / 0.05))


def test_openpcdet_configuration_is_yaml_with_the_range_of_the_labels(tmp_path):
    write("openpcdet", make_frames(), make_run(), tmp_path)
    found = yaml.safe_load((tmp_path / "custom_dataset.yaml").read_text())
    boxes = [read_labels(path) for path in sorted((tmp_path / "labels").iterdir())]
    assert found["POINT_CLOUD_RANGE"] == point_cloud_range(np.concatenate([box for box, _ in boxes])).tolist()
    assert found["CLASS_NAMES"] == list(FORMATS["openpcdet"].classes.values())
    assert set(found["MAP_CLASS_TO_KITTI"]) == {*found["CLASS_NAMES"], "DontCare"}
    low, high = np.array(found["POINT_CLOUD_RANGE"]).reshape(2, 3)
    cells = (high - low) / found["DATA_PROCESSOR"][2]["VOXEL_SIZE"]
    assert cells[:2] % 16 == pytest.approx([0, 0])
    assert cells[2] == pytest.approx(1)


@given(st.integers(0, 10_000))
def test_kitti_labels_turn_back_into_the_boxes(seed):
    frame = make_frame(seed)
    sample = _sample(frame, FORMATS["kitti"])
    lines = FORMATS["kitti"].sample_files(sample)["training/label_2/000000.txt"]().decode().splitlines()
    assert len(lines) == max(1, len(sample.boxes))
    for row, line in enumerate(lines if len(sample.boxes) else []):
        words = line.split(" ")
        assert len(words) == KITTI_COLUMNS
        assert words[0] == sample.classes[row]
        height, width, length, x, y, z, turn = map(float, words[8:])
        assert [length, width, height] == sample.boxes.size[row].tolist()
        assert (z, -x) == tuple(sample.boxes.centre[row, :2])
        assert -y + height / 2 == pytest.approx(sample.boxes.centre[row, 2], abs=1e-14)
        assert -math.pi <= turn < math.pi
        assert _same_direction(-turn - math.pi / 2, sample.boxes.yaw[row])
        # seen from the camera along its own ray, alpha is the turn
        assert math.remainder(float(words[3]) + math.atan2(x, z) - turn, math.tau) == pytest.approx(0.0, abs=1e-6)
        assert words[4:8] == ["0", "0", "100", "100"]


@pytest.mark.parametrize(("visibility", "occluded"), [(0.8, "0"), (0.79, "1"), (0.39, "2")])
def test_kitti_occlusion_follows_visibility(visibility, occluded):
    frame = make_frame(1, users=1)
    labels = replace(frame.labels, visibility=np.array([visibility]))
    sample = _sample(replace(frame, labels=labels), FORMATS["kitti"])
    assert FORMATS["kitti"].sample_files(sample)["training/label_2/000000.txt"]().split()[2].decode() == occluded


def test_the_viewpoint_of_a_sensors_cloud_is_its_pose():
    sample = _sample(make_frame(), FORMATS["pcd"])
    for path, content in FORMATS["pcd"].sample_files(sample).items():
        (line,) = [line for line in content().split(b"\n") if line.startswith(b"VIEWPOINT")]
        words = line.decode().split()[1:]
        sensor = next((one for one in sample.run.sensors if f"/{one.label}/" in path), None)
        if sensor is None:
            assert words == ["0", "0", "0", "1", "0", "0", "0"]
        else:
            x, y, z, qw, qx, qy, qz = map(float, words)
            assert np.abs(np.array([x, y, z]) - sensor.xyz).max() < 1e-9
            turn = Rotation.from_quat([qx, qy, qz, qw]).as_matrix()
            assert np.abs(turn - sensor.orientation).max() < 1e-8


def _sample(frame, kind):
    return make_sample((0, "000000"), make_run(), frame, kind.classes, 1)


def _same_direction(one, other):
    return math.remainder(one - other, 2 * math.pi) == pytest.approx(0.0, abs=1e-12)
