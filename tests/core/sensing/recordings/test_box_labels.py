"""Labelled boxes, and files that hold none."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.output.datasets.formats import openpcdet_results
from seip_addon.core.sensing.recordings.box_labels import read_labels
from seip_addon.core.sensing.traffic.trajectories import CATEGORIES
from tests.builders.scan_frames import make_frames, make_run, write


def make_boxes(seed=0, count=12):
    random = np.random.default_rng(seed)
    boxes = np.column_stack(
        [random.uniform(-90, 90, (count, 3)), random.uniform(0.3, 12, (count, 3)), random.uniform(-np.pi, np.pi, count)]
    )
    return boxes, [CATEGORIES[number % len(CATEGORIES)] for number in range(count)]


def read(folder, text, name="a.txt"):
    (folder / name).write_text(text, encoding="utf-8")
    return read_labels(folder / name)


def same(found, boxes, categories):
    assert found.category.tolist() == list(categories)
    assert len(found) == len(boxes)
    difference = found.boxes - boxes
    difference[:, 6] = np.angle(np.exp(1j * difference[:, 6]))
    assert np.abs(difference).max(initial=0.0) < 1e-9
    assert ((found.boxes[:, 6] >= -np.pi) & (found.boxes[:, 6] < np.pi)).all()


@given(st.integers(0, 10_000), st.integers(0, 20))
def test_detections_are_read_back(tmp_path_factory, seed, count):
    boxes, categories = make_boxes(seed, count)
    text = openpcdet_results(boxes, categories, np.full(count, 0.5))
    same(read(tmp_path_factory.mktemp("labels"), text), boxes, categories)


def test_labels_of_a_dataset(tmp_path):
    frames = make_frames(users=9)
    write("openpcdet", frames, make_run(), tmp_path, min_points=0)
    for number, (_, frame) in enumerate(frames):
        known = frame.labels
        boxes = np.column_stack([known.centre, known.size, known.yaw])
        same(read_labels(tmp_path / f"labels/{number:06d}.txt"), boxes, known.category.tolist())


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("middle of a box is 20000", "2e4 2 3 4 2 1 0 Car\n"),
        ("its size is -4", "1 2 3 -4 2 1 0 Car\n"),
        ("its yaw is inf", "1 2 3 4 2 1 inf Car\n"),
        ("7 columns, not 8", "1 2 3 4 5 6 Car\n"),
        ("no readable labels", "1 2 3 4 2 wide 0 Car\n"),
        ("17 columns, not 8", "Car " + "1 " * 16),
    ],
)
def test_refusals(words, text, tmp_path):
    with pytest.raises(SeipError, match=words) as caught:
        read(tmp_path, text)
    assert "a.txt" in str(caught.value)
