"""Samples of a dataset: frames of traffic runs with their labels."""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Boolean, Float
from ...errors import SeipError
from ...sensing.scans.frame import Frame, Labels
from ...sensing.scans.sensor import MountedSensor

SPLITS = ("train", "val", "test")

WRITTEN = "written"
OUTSIDE = "outside_region"
NO_CLASS = "no_class"
TOO_FEW = "too_few_points"
OUTCOMES = (WRITTEN, OUTSIDE, NO_CLASS, TOO_FEW)
"""What can become of a label, as the manifest counts it; the first that applies of those after `WRITTEN`."""

_FILE_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,99}")


@dataclass(frozen=True, eq=False)
class TrafficRun:
    """One simulation of traffic, whole in one split: frames of a run resemble each other too much to be torn apart.

    Parameters
    ----------
    name : str
        Name of the run, unique in a dataset; also the name of its folders.
    split : str
        One of `SPLITS`.
    key : str
        Digest of all that the frames follow from: runs of one key are the same frames.
    sensors : tuple of MountedSensor
        In the order of the frames' sensor numbers.
    origin : (3,) float64, metres
        Map coordinates of the local origin: map = local + origin.
    record : mapping
        What else the manifest shall say of the simulation (seeds, settings, versions): values that JSON can hold.
    """

    name: str
    split: str
    key: str
    sensors: tuple[MountedSensor, ...]
    origin: Float
    record: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_file_name(self.name, "the run", "give it another")
        if self.split not in SPLITS:
            raise SeipError(f"there is no split '{self.split}'; choose one of {', '.join(SPLITS)}")
        if not self.sensors:
            raise SeipError(f"the run '{self.name}' has no sensors; place some and simulate it again")
        for sensor in self.sensors:
            require_file_name(sensor.label, "the sensor", "rename its empty")
        labels = Counter(sensor.label.lower() for sensor in self.sensors)
        twice = next((label for label, count in labels.items() if count > 1), None)
        if twice is not None:
            raise SeipError(f"two sensors are called '{twice}'; rename one")


@dataclass(frozen=True, eq=False)
class Sample:
    """A frame as it stands in a dataset.

    Parameters
    ----------
    number : int
        Number of the frame in the whole dataset, from 0.
    frame_id : str
        Identifier of the frame in its run.
    frame : Frame
        With all its labels.
    fates : tuple of str
        Outcome for each of them, one of `OUTCOMES`.
    classes : tuple of str
        Class of each box, as the format names it.
    """

    number: int
    frame_id: str
    run: TrafficRun
    frame: Frame
    fates: tuple[str, ...]
    boxes: Labels
    classes: tuple[str, ...]

    @property
    def name(self) -> str:
        """The number as file names have it."""
        return f"{self.number:06d}"


def make_sample(
    place: tuple[int, str], run: TrafficRun, frame: Frame, classes: Mapping[str, str], min_points: int
) -> Sample:
    """Return a frame with those labels that are to be written.

    Parameters
    ----------
    place : (int, str)
        The frame's number in the dataset and its id in the run.
    classes : mapping of str to str
        The format's name of each category.
    min_points : int
        Returns of all sensors together that a label needs.

    Examples
    --------
    >>> from seip_addon.core.sensing.lidar.catalogue import load_catalogue
    >>> sensor = MountedSensor("S1", load_catalogue()["vlp16"], np.array([0.0, 0.0, 5.0]), np.eye(3))
    >>> run = TrafficRun("run-1", "train", "digest", (sensor,), origin=np.zeros(3))
    >>> number, category, points = np.array([0, 1]), np.array(["car", "pedestrian"]), np.array([[120], [2]])
    >>> boxes = np.zeros((2, 3)), np.ones((2, 3)), *np.zeros((3, 2))
    >>> users = Labels(number, category, *boxes, points, visibility=np.ones(2), inside=np.ones(2, bool))
    >>> frame = Frame(12.0, np.empty((0, 3)), *np.empty((5, 0)), labels=users)
    >>> sample = make_sample((3, "000120"), run, frame, {"car": "Car", "pedestrian": "Pedestrian"}, min_points=5)
    >>> sample.name, sample.fates, sample.classes
    ('000003', ('written', 'too_few_points'), ('Car',))
    """
    labels = frame.labels
    returns = labels.points.sum(axis=1)
    found = tuple(
        OUTSIDE if not inside else NO_CLASS if str(category) not in classes else TOO_FEW if few else WRITTEN
        for inside, category, few in zip(labels.inside, labels.category, returns < min_points, strict=True)
    )
    boxes = subset(labels, np.array([fate == WRITTEN for fate in found], dtype=bool))
    names = tuple(classes[str(category)] for category in boxes.category)
    return Sample(*place, run=run, frame=frame, fates=found, boxes=boxes, classes=names)


def subset(labels: Labels, keep: Boolean) -> Labels:
    """Return those of the labels where ``keep``, (k,) bool, is true."""
    return Labels(**{part.name: getattr(labels, part.name)[keep] for part in fields(Labels)})


def cloud(frame: Frame) -> NDArray[np.float32]:
    """Return x, y, z (metres, local site axes) and intensity (0 to 1) of all points, (n, 4) float32 little-endian."""
    return np.column_stack([frame.points, frame.intensity]).astype("<f4")


def require_file_name(name: str, whose: str, cure: str) -> None:
    """Raise `SeipError` unless a name can be that of a file on every system."""
    if not _FILE_NAME.fullmatch(name):
        raise SeipError(
            f"{whose} {name!r} cannot give its name to a file; {cure}, of up to 100 letters, digits, '_', '-' and '.'"
        )


def shortest(value: float) -> str:
    """Return the shortest text that reads back as the same float64, and zero without a sign."""
    return repr(float(value) + 0.0)
