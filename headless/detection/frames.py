"""Frames of runs as training samples, and the check that splits are independent."""

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from seip_addon.core.base.arrays import Float, Integer
from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.scans.frame import Frame

from .detection_area import DetectionArea
from .detector import TrainingRecord
from .pillars import fill_pillars
from .settings import CLASS_OF


@dataclass(frozen=True, eq=False)
class Recording:
    """Scans of one run of traffic by one sensor configuration.

    Parameters
    ----------
    name : str
        For messages.
    traffic : str
        Identifier of the run of traffic: the source of its trajectories, with its seed.
    count : int
        Number of frames.
    load : callable
        From a frame's number to the frame, which may be simulated then.
    sensors : tuple of str
        Catalogue keys of the sensors' types, where they are known.
    site : str
        The scene's name, where it is known.
    placement : str
        Identifier of the sensors' poses.
    """

    name: str
    traffic: str
    count: int
    load: Callable[[int], Frame]
    sensors: tuple[str, ...] = ()
    site: str = ""
    placement: str = ""


@dataclass(frozen=True, eq=False)
class TrainingSample:
    """A training sample: the foreground of a frame and its boxes, with heights above the road.

    Parameters
    ----------
    points : (n, 4) float32
        x, y, height (metres), intensity; by ascending x, and of each pillar no more than it can keep.
    boxes : (k, 7) float64
        x, y, height of the middle, length, width, height (metres), yaw; of all road users in the area.
    category : (k,) int64
        Index into `settings.CLASSES`.
    returns : (k,) int64
        Returns from each road user, of all sensors.
    """

    points: NDArray[np.float32]
    boxes: Float
    category: Integer
    returns: Integer


def sample_of(frame: Frame, area: DetectionArea, most_points: int) -> TrainingSample:
    """Return the training sample of a frame, for pillars that keep ``most_points``."""
    labels = frame.labels
    cloud = area.cloud(frame)
    points = cloud[fill_pillars(cloud, area.grid, most_points).chosen]
    boxes = area.levelled(np.column_stack((labels.centre, labels.size, labels.yaw)))
    inside = area.grid.holds(boxes)
    return TrainingSample(
        points=points[np.lexsort(points.T[::-1])],
        boxes=boxes[inside],
        category=np.array([CLASS_OF[name] for name in labels.category[inside].tolist()], dtype=np.int64),
        returns=labels.points.sum(axis=1)[inside],
    )


class SampledRecording:
    """Samples of a recording, each made on first access and kept; a sample takes some hundred kilobytes.

    Parameters
    ----------
    area : DetectionArea
        Detection area of the recording's site.
    most_points : int
        Largest number of points that a pillar keeps.
    """

    def __init__(self, recording: Recording, area: DetectionArea, most_points: int) -> None:
        self.recording, self.area, self.most_points = recording, area, most_points
        self.get = functools.cache(self._sample)

    def __len__(self) -> int:
        return self.recording.count

    def _sample(self, frame: int) -> TrainingSample:
        """Return the sample of a frame."""
        return sample_of(self.recording.load(frame), self.area, self.most_points)


def drawn(recordings: Sequence[SampledRecording], random: np.random.Generator) -> TrainingSample:
    """Return a random sample: every recording is as likely, however many frames it has."""
    recording = recordings[int(random.integers(len(recordings)))]
    return recording.get(int(random.integers(len(recording))))


def spread(recordings: Sequence[SampledRecording], most: int) -> list[tuple[DetectionArea, TrainingSample]]:
    """Return at most n samples with their areas, spread evenly over all recordings."""
    each = max(1, most // len(recordings))
    chosen = []
    for recording in recordings[:most]:
        count = min(each, len(recording))
        chosen += [
            (recording.area, recording.get((2 * part + 1) * len(recording) // (2 * count))) for part in range(count)
        ]
    return chosen


def training_record_of(recordings: Sequence[Recording]) -> TrainingRecord:
    """Return the sensor types and sites of recordings."""
    return TrainingRecord(
        sensors=tuple(sorted({sensor for recording in recordings for sensor in recording.sensors})),
        sites=tuple(sorted({recording.site for recording in recordings} - {""})),
    )


def require_separate(splits: Mapping[str, Sequence[Recording]]) -> None:
    """Raise SeipError where a run is in two splits: its frames show the same vehicles in the same places.

    Parameters
    ----------
    splits : mapping of str to sequence of Recording
        What the splits are for, and their recordings.

    Raises
    ------
    SeipError
        One is.
    """
    for (one, these), (other, those) in combinations(splits.items(), 2):
        for a, b in product(these, those):
            if a.traffic == b.traffic:
                raise SeipError(
                    f"{a.name} ({one}) and {b.name} ({other}) show the same run of traffic: "
                    "a detector must be tested on traffic that it has not seen, so simulate another run for one of them"
                )
