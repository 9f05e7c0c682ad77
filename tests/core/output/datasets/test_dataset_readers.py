"""Each format, read back by the reader that its users use: the same points, the same boxes, each around its points.

What a reader's library does is done by the library where there is one to install: ``.ci/readers`` runs these tests
with all of them.
OpenPCDet cannot: there the test takes the steps that its documentation and sources describe, and says which.
"""

import math
import warnings

import numpy as np
import pytest

from tests.builders.scan_frames import make_frames, make_run, rotation, write

IN_FLOAT32 = 1e-5  # metres, of places within 100 m that a reader keeps in float32


def reader(name):
    """Import a reader; open3d and its kin warn of what they stand on, which is none of ours."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip(name, reason=f"{name} is not here: .ci/readers runs this", exc_type=ImportError)


def kept(frame, excluded=()):
    labels = frame.labels
    return np.flatnonzero((labels.points.sum(axis=1) > 0) & ~np.isin(labels.category, list(excluded)))


def require_around(box_centre, box_size, turn, points):
    """The points lie in the box, given by its middle, its size and the rotation from its axes."""
    inside = np.abs((points - box_centre) @ turn) <= np.asarray(box_size) / 2
    assert inside.all()


def cloud(frame):
    return np.column_stack([frame.points, frame.intensity])


@pytest.fixture
def frames():
    return make_frames(seed=0, count=3, users=14)


def test_openpcdet(frames, tmp_path):
    """CustomDataset.get_infos, get_lidar and __getitem__: read as float32, drop DontCare."""
    write("openpcdet", frames, make_run(), tmp_path)
    names = [line.strip() for line in (tmp_path / "ImageSets" / "train.txt").read_text().splitlines()]
    assert len(names) == len(frames)
    for name, (_, frame) in zip(names, frames, strict=True):
        points = np.load(tmp_path / "points" / f"{name}.npy")
        assert points.dtype == np.float32
        assert (points == cloud(frame)).all()
        rows = [line.strip().split(" ") for line in (tmp_path / "labels" / f"{name}.txt").read_text().splitlines()]
        boxes = np.array([row[:-1] for row in rows], dtype=np.float32)[:, :7]
        users = kept(frame)
        assert len(boxes) == len(users)
        for box, user in zip(boxes, users, strict=True):
            require_around(box[:3], box[3:6] + 1e-4, rotation(box[6]), points[frame.instance == user, :3])
            assert box == pytest.approx(
                [*frame.labels.centre[user], *frame.labels.size[user], frame.labels.yaw[user]], rel=1e-6, abs=1e-6
            )


def test_kitti_by_open3d_ml(frames, tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        reader("open3d")
        kitti = reader("open3d._ml3d.datasets.kitti").KITTI
    write("kitti", frames, make_run(), tmp_path)
    found = kitti(str(tmp_path), cache_dir=str(tmp_path / "cache")).get_split("training")
    assert len(found) == len(frames)
    for number, (_, frame) in enumerate(frames):
        path = found.get_attr(number)["path"]
        points = found.dataset.read_lidar(path)
        assert (points == cloud(frame)).all()
        calibration = found.dataset.read_calib(path.replace("velodyne", "calib").replace(".bin", ".txt"))
        boxes = found.dataset.read_label(path.replace("velodyne", "label_2").replace(".bin", ".txt"), calibration)
        users = kept(frame)
        assert len(boxes) == len(users)
        for box, user in zip(boxes, users, strict=True):
            assert box.get_difficulty() >= 0
            corners = box.generate_corners3d() @ calibration["world_cam"][:3, :3].T
            lowest, highest = corners.min(axis=0), corners.max(axis=0)
            assert (lowest + highest) / 2 == pytest.approx(frame.labels.centre[user], abs=IN_FLOAT32)
            along = (corners[0] + corners[1] - corners[2] - corners[3]) / 2
            assert math.hypot(*along) == pytest.approx(frame.labels.size[user, 0])
            assert math.remainder(math.atan2(along[1], along[0]) - frame.labels.yaw[user], math.tau) == pytest.approx(
                0.0, abs=1e-9
            )
            require_around(
                box.center,
                frame.labels.size[user],
                rotation(-box.yaw - math.pi / 2),
                points[frame.instance == user, :3],
            )


def test_pcd_by_pypcd4(frames, tmp_path):
    pypcd4 = reader("pypcd4")
    write("pcd", frames, make_run(), tmp_path)
    for name, frame in frames:
        found = pypcd4.PointCloud.from_path(tmp_path / f"train/a/merged/{name}.pcd")
        assert (found.numpy(("x", "y", "z", "intensity")) == cloud(frame)).all()
