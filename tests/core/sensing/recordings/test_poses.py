"""Poses of sensors, and files that hold none."""

import json

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.recordings.poses import read_poses
from tests.builders.scan_frames import rotation


def make_pose(seed=0):
    random = np.random.default_rng(seed)
    pose = np.eye(4)
    pose[:3, :3] = rotation(*random.uniform(-1.5, 1.5, 3))
    pose[:3, 3] = random.uniform(-100, 100, 3)
    return pose


def read(folder, name, text):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return read_poses(path)


def refused(words, folder, text, name="p.json"):
    with pytest.raises(SeipError, match=words) as caught:
        read(folder, name, text)
    assert name in str(caught.value)


def same(found, expected):
    assert found.keys() == expected.keys()
    for name, pose in found.items():
        assert pose.dtype == np.float64
        np.testing.assert_allclose(pose, expected[name], rtol=0.0, atol=1e-9)


POSES = {"S1": make_pose(1), "s110_lidar.south": make_pose(2), "Pole 3": make_pose(3)}
LISTS = {name: pose.tolist() for name, pose in POSES.items()}


@pytest.mark.parametrize("flat", [True, False])
def test_json(flat, tmp_path):
    lists = {name: np.ravel(pose).tolist() if flat else pose for name, pose in LISTS.items()}
    same(read(tmp_path, "p.json", json.dumps(lists)), POSES)


def test_rotations_that_are_rounded_are_made_exact(tmp_path):
    pose = make_pose()
    found = read(tmp_path, "p.json", json.dumps({"S1": pose.round(4).tolist()}))["S1"]
    np.testing.assert_allclose(found[:3, :3].T @ found[:3, :3], np.eye(3), rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(found, pose, rtol=0.0, atol=2e-4)


def changed(at, value):
    pose = make_pose()
    pose[at] = value
    return json.dumps({"S1": pose.tolist()})


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("mirrored", json.dumps({"S1": np.diag([1, -1, 1, 1]).tolist()})),
        ("scaled or skewed", json.dumps({"S1": np.diag([1.002, 1, 1, 1]).tolist()})),
        ("scaled or skewed", json.dumps({"S1": np.diag([0, 0, 0, 1]).tolist()})),
        ("scaled or skewed", changed((0, 0), 1e6)),
        ("last row", changed((3, 0), 1.0)),
        ("16 numbers", changed((0, 3), 1e8)),
        ("16 numbers", json.dumps({"S1": np.eye(3).tolist()})),
        ("number NaN", changed((0, 3), np.nan)),
        ("no readable poses", json.dumps({"S1": [[1, 2], [3]]})),
        ("no readable poses", json.dumps({"S1": {"x": 1}})),
        ("its structure is another one", "[1, 2]"),
        ("names no sensor", "{}"),
        ("printable characters", json.dumps({"": np.eye(4).tolist()})),
        ("printable characters", json.dumps({"S" * 4000: np.eye(4).tolist()})),
        ("no readable poses", "[" * 100_000),
        ("no readable poses", '{"S1": '),
        ("is empty", ""),
    ],
)
def test_refusals(words, text, tmp_path):
    refused(words, tmp_path, text)
