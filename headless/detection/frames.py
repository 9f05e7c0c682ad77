"""Frames to learn from: which run they are from, and what a detector takes of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import overload

import numpy as np
from numpy.typing import NDArray

from seip_addon.core.arrays import Float, Integer
from seip_addon.core.errors import SeipError
from seip_addon.core.scans.frame import Frame
from seip_addon.core.scans.run_folder import frame_path, load_manifest

from .pillars import PillarGrid, fill_pillars
from .settings import CLASS_OF


@dataclass(frozen=True, eq=False)
class Recording:
    """What one configuration of sensors measured of one run of traffic.

    Parameters
    ----------
    name : str
        For messages.
    traffic : str
        What tells the run of traffic from all others: the source of its trajectories, with its seed.
    frames : sequence of Frame
        In memory, or read when they are asked for.
    """

    name: str
    traffic: str
    frames: Sequence[Frame]


def recording_of(folder: Path) -> Recording:
    """Return what a folder of scans holds; its frames are read when they are asked for.

    Raises
    ------
    SeipError
        There is no run of scans in it, or one that was not finished.
    """
    record = load_manifest(folder)
    if not record["complete"]:
        raise SeipError(f"the run in {folder} was stopped half-way: run the same simulation again to finish it")
    frames = FrameFiles([frame_path(folder, number) for number in range(len(record["frames"]))])
    return Recording(name=str(folder), traffic=str(record["trajectories"]["source"]), frames=frames)


class FrameFiles(Sequence[Frame]):
    """Frames in files, read when they are asked for.

    Parameters
    ----------
    paths : sequence of Path
    """

    def __init__(self, paths: Sequence[Path]) -> None:
        self._paths = tuple(paths)

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self._paths)

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> FrameFiles: ...
    def __getitem__(self, index: int | slice) -> Frame | FrameFiles:
        """Read one frame, or return some that are not read yet."""
        if isinstance(index, slice):
            return FrameFiles(self._paths[index])
        return Frame.load(self._paths[index])


@dataclass(frozen=True, eq=False)
class Sample:
    """What a detector learns from a frame.

    Parameters
    ----------
    points : (n, 4) float32
        x, y, z (metres, local site axes), intensity; of each pillar no more than it can keep.
    boxes : (k, 7) float64
        x, y, z of the middle, length, width, height (metres), yaw; of all road users in the extent.
    category : (k,) int64
        Index into `settings.CLASSES`.
    returns : (k,) int64
        From each, of all sensors.
    """

    points: NDArray[np.float32]
    boxes: Float
    category: Integer
    returns: Integer


def sample_of(frame: Frame, grid: PillarGrid, most_points: int) -> Sample:
    """Return what a detector on a grid, whose pillars keep ``most_points``, can learn from a frame."""
    labels = frame.labels
    points = np.column_stack((frame.points, frame.intensity))
    kept = np.sort(fill_pillars(points, grid, most_points).chosen)
    inside = grid.holds(labels.centre)
    return Sample(
        points=points[kept],
        boxes=np.column_stack((labels.centre, labels.size, labels.yaw))[inside],
        category=np.array([CLASS_OF[name] for name in labels.category[inside].tolist()], dtype=np.int64),
        returns=labels.points.sum(axis=1)[inside],
    )


class Samples:
    """The samples of some recordings, each made when it is first asked for and kept: a few megabytes at most.

    Parameters
    ----------
    recordings : sequence of Recording
    grid : PillarGrid
    most_points : int
    """

    def __init__(self, recordings: Sequence[Recording], grid: PillarGrid, most_points: int) -> None:
        self.recordings = [recording for recording in recordings if len(recording.frames)]
        self.grid, self.most_points = grid, most_points
        self._made: dict[tuple[int, int], Sample] = {}
        if not self.recordings:
            raise SeipError("there is no frame to learn from: simulate some first")

    def drawn(self, random: np.random.Generator) -> Sample:
        """Return a random one: every recording is as likely, however many frames it has."""
        recording = int(random.integers(len(self.recordings)))
        return self.get(recording, int(random.integers(len(self.recordings[recording].frames))))

    def spread(self, most: int) -> list[Sample]:
        """Return so many at most, of all recordings in turn and from all over each."""
        each = max(1, most // len(self.recordings))
        chosen = []
        for number, recording in enumerate(self.recordings[:most]):
            count = min(each, len(recording.frames))
            chosen += [self.get(number, (2 * part + 1) * len(recording.frames) // (2 * count)) for part in range(count)]
        return chosen

    def get(self, recording: int, frame: int) -> Sample:
        """Return the sample of a frame of a recording."""
        key = (recording, frame)
        if key not in self._made:
            self._made[key] = sample_of(self.recordings[recording].frames[frame], self.grid, self.most_points)
        return self._made[key]


def require_separate(splits: Mapping[str, Sequence[Recording]]) -> None:
    """See that no run of traffic is in two splits: neighbouring frames show the same vehicles in the same places.

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
        for a, b in _pairs(these, those):
            if a.traffic == b.traffic:
                raise SeipError(
                    f"{a.name} ({one}) and {b.name} ({other}) show the same run of traffic: "
                    "a detector must be tested on traffic that it has not seen, so simulate another run for one of them"
                )


def _pairs(these: Sequence[Recording], those: Sequence[Recording]) -> Iterator[tuple[Recording, Recording]]:
    return ((a, b) for a in these for b in those)
