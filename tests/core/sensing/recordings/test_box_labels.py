"""Labelled boxes in all formats, and files that hold none."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.output.datasets.formats import kitti_results, openpcdet_results
from seip_addon.core.sensing.recordings.box_labels import read_labels
from seip_addon.core.sensing.traffic.trajectories import CATEGORIES
from tests.builders.recording_files import dair_text, openlabel_text
from tests.builders.scan_frames import make_frames, make_run, write

KITTI_CATEGORY = {"bus": "truck", "motorcycle": "bicycle"}  # KITTI has neither


def make_boxes(seed=0, count=12):
    random = np.random.default_rng(seed)
    boxes = np.column_stack(
        [random.uniform(-90, 90, (count, 3)), random.uniform(0.3, 12, (count, 3)), random.uniform(-np.pi, np.pi, count)]
    )
    return boxes, [CATEGORIES[number % len(CATEGORIES)] for number in range(count)]


def read(folder, text, name="a.txt"):
    (folder / name).write_text(text, encoding="utf-8")
    return read_labels(folder / name)


def same(found, boxes, categories, ignored=None):
    assert found.category.tolist() == list(categories)
    assert found.ignored == (ignored or {})
    assert len(found) == len(boxes)
    difference = found.boxes - boxes
    difference[:, 6] = np.angle(np.exp(1j * difference[:, 6]))
    assert np.abs(difference).max(initial=0.0) < 1e-9
    assert ((found.boxes[:, 6] >= -np.pi) & (found.boxes[:, 6] < np.pi)).all()


@given(st.integers(0, 10_000), st.integers(0, 20))
def test_the_formats_hold_the_same(tmp_path_factory, seed, count):
    folder = tmp_path_factory.mktemp("labels")
    boxes, categories = make_boxes(seed, count)
    rows = boxes.tolist()
    score = np.full(count, 0.5)
    in_kitti = [KITTI_CATEGORY.get(category, category) for category in categories]
    same(read(folder, kitti_results(boxes, categories, score)), boxes, in_kitti)
    same(read(folder, openpcdet_results(boxes, categories, score)), boxes, categories)
    same(read(folder, openlabel_text(rows, [category.upper() for category in categories])), boxes, categories)
    names = {"bicycle": "Cyclist", "motorcycle": "Motorcyclist"}
    same(read(folder, dair_text(rows, [names.get(one, one.title()) for one in categories])), boxes, categories)


def test_openlabel_has_quaternions_or_euler_angles(tmp_path):
    boxes, categories = make_boxes(count=3)
    content = json.loads(openlabel_text(boxes.tolist(), categories))
    for entry, box in zip(content["openlabel"]["frames"]["0"]["objects"].values(), boxes.tolist(), strict=True):
        entry["object_data"]["cuboid"]["val"] = [*box[:3], 0.0, 0.0, box[6], *box[3:6]]
    same(read(tmp_path, json.dumps(content)), boxes, categories)
    for entry in content["openlabel"]["frames"]["0"]["objects"].values():
        entry["object_data"]["cuboid"]["val"].append(0.0)
        entry["object_data"]["cuboid"]["val"].append(0.0)
    with pytest.raises(SeipError, match="11 numbers"):
        read(tmp_path, json.dumps(content))


@pytest.mark.parametrize("kind", ["kitti", "openpcdet"])
def test_labels_of_datasets(kind, tmp_path):
    frames = make_frames(users=9)
    write(kind, frames, make_run(), tmp_path, min_points=0)
    labels = "training/label_2" if kind == "kitti" else "labels"
    for number, (_, frame) in enumerate(frames):
        known = frame.labels
        boxes = np.column_stack([known.centre, known.size, known.yaw])
        names = {} if kind == "openpcdet" else KITTI_CATEGORY
        categories = [names.get(str(category), str(category)) for category in known.category]
        same(read_labels(tmp_path / f"{labels}/{number:06d}.txt"), boxes, categories)


def test_openlabel_as_the_standard_has_it(tmp_path):
    """Types stand at the top, cuboids in lists, and a box that leans has the heading of its length in plan."""
    content = json.loads(openlabel_text([[1.0, 2.0, 3.0, 4.0, 2.0, 1.5, 0.7]], ["car"]))["openlabel"]
    data = content["frames"]["0"]["objects"]["id-0"]["object_data"]
    del data["type"]
    tilt, yaw = 0.1, 0.7
    turn = [-np.sin(tilt / 2) * np.sin(yaw / 2), np.sin(tilt / 2) * np.cos(yaw / 2)]
    turn += [np.cos(tilt / 2) * np.sin(yaw / 2), np.cos(tilt / 2) * np.cos(yaw / 2)]
    data["cuboid"]["val"][3:7] = turn
    data["cuboid"] = [data["cuboid"]]
    content["objects"] = {"id-0": {"type": "car", "name": "car1"}}
    same(read(tmp_path, json.dumps({"openlabel": content})), [[1.0, 2.0, 3.0, 4.0, 2.0, 1.5, 0.7]], ["car"])


BOX = [1.0, 2.0, 3.0, 4.0, 2.0, 1.5, 0.7]


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("2 frames, not one", openlabel_text([BOX], ["car"], frames=2)),
        ("0 frames, not one", openlabel_text([BOX], ["car"], frames=0)),
        ("openlabel", "{}"),
        ("quaternion", openlabel_text([BOX], ["car"]).replace("0.9393727128473789", "9")),
        ("no readable labels", openlabel_text([BOX], ["car"]).replace('"val"', '"value"')),
        ("middle of a box is 20000", dair_text([[2e4, *BOX[1:]]], ["Car"])),
        ("its size is -4", dair_text([[*BOX[:3], -4.0, *BOX[4:]]], ["Car"])),
        ("its yaw is inf", dair_text([[*BOX[:6], np.inf]], ["Car"])),
        ("number NaN", '[{"type": "Car", "rotation": NaN}]'),
        ("3d_dimensions", '[{"type": "Car"}]'),
        ("no readable labels", "[1, 2]"),
        ("no readable labels", "[" * 100_000),
        ("7 columns, not 8", "1 2 3 4 5 6 Car\n"),
        ("8 columns, not 15", "Car 0 0 0 0 0 0 0 1 2 3 4 5 6 7\n1 2 3 4 2 1 0 Car\n"),
        ("no readable labels", "1 2 3 4 2 wide 0 Car\n"),
        ("17 columns, not 15", "Car " + "1 " * 16),
    ],
)
def test_refusals(words, text, tmp_path):
    with pytest.raises(SeipError, match=words) as caught:
        read(tmp_path, text)
    assert "a.txt" in str(caught.value)


def test_cut_files(tmp_path):
    boxes, categories = make_boxes()
    for text in (openlabel_text(boxes.tolist(), categories), dair_text(boxes.tolist(), categories)):
        for part in range(1, 50):
            with pytest.raises(SeipError, match=r"a\.txt"):
                read(tmp_path, text[: len(text) * part // 50])
