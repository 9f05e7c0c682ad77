"""One frame: the merged point cloud of all sensors, and the road users of that instant."""

from __future__ import annotations

import os
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Boolean, Float, Integer, Text
from ...storage.array_file import ArrayFile

_POINTS = {
    "points": "f4",
    "sensor": "i2",
    "delay": "f4",
    "intensity": "f4",
    "instance": "i4",
    "foreground": "b1",
}
_LABELS = {
    "labels.user": "i8",
    "labels.category": "U",
    "labels.centre": "f8",
    "labels.size": "f8",
    "labels.yaw": "f8",
    "labels.pitch": "f8",
    "labels.speed": "f8",
    "labels.points": "i8",
    "labels.visibility": "f8",
    "labels.inside": "b1",
}
FILE = ArrayFile("seip.frame", 3, "frame of scans", "simulate it again", _POINTS | _LABELS, compressed=False)

STATIC_INSTANCE = -1
"""Instance of points that are not on a road user."""


@dataclass(frozen=True, eq=False)
class Labels:
    """All road users of one frame, seen or not; k boxes.

    Boxes are at their poses at the frame's time. With a rolling shutter each is at the mean time of its own returns, or
    halfway through the frame if it has none.

    Parameters
    ----------
    user : (k,) int64
        Index into the trajectories' road users; the points' ``instance`` refers to it.
    category : (k,) str
        Category of each road user.
    centre : (k, 3) float64, metres
        Centre of the box, local site axes.
    size : (k, 3) float64, metres
        Length, width, height.
    yaw, pitch : (k,) float64, radians
        Yaw counter-clockwise from +x, in [-π, π); pitch nose up positive.
    speed : (k,) float64, metres per second
        Speed of each road user.
    points : (k, s) int64
        Number of returns from each road user, by sensor.
    visibility : (k,) float64, 0 to 1
        Share of the rays of all sensors that meet the road user, of those that would meet it in an empty scene.
    inside : (k,) bool
        Whether the centre of the box is in the region of interest in plan.
    """

    user: Integer
    category: Text
    centre: Float
    size: Float
    yaw: Float
    pitch: Float
    speed: Float
    points: Integer
    visibility: Float
    inside: Boolean

    def __len__(self) -> int:
        """Return the number of boxes."""
        return len(self.user)


@dataclass(frozen=True, eq=False)
class Frame:
    """Point cloud of all sensors in one revolution, sensor after sensor; n points.

    Parameters
    ----------
    time : float, seconds
        Time of the simulation at which the revolution begins.
    points : (n, 3) float32, metres
        Points in local site axes.
    sensor : (n,) int16
        Number of the sensor, in the order of the manifest.
    delay : (n,) float32, seconds
        Time of each point after ``time``; zero without a rolling shutter.
    intensity : (n,) float32, 0 to 1
        Intensity of each return.
    instance : (n,) int32
        Road user that each point is on, or `STATIC_INSTANCE`.
    foreground : (n,) bool
        Whether the point is nearer than the same ray's hit in the empty scene, by more than the noise: the points that
        remain after background subtraction.

    Examples
    --------
    Three points, two of which are on a car:

    >>> car = Labels(
    ...     user=np.array([7]),
    ...     category=np.array(["car"]),
    ...     centre=np.array([[12.0, 3.0, 0.75]]),
    ...     size=np.array([[4.5, 1.8, 1.5]]),
    ...     yaw=np.zeros(1),
    ...     pitch=np.zeros(1),
    ...     speed=np.array([8.3]),
    ...     points=np.array([[2]]),
    ...     visibility=np.array([0.5]),
    ...     inside=np.array([True]),
    ... )
    >>> frame = Frame(
    ...     time=30.0,
    ...     points=np.array([[9.75, 3.0, 0.5], [9.75, 3.25, 1.0], [20.0, 3.0, 0.0]], dtype=np.float32),
    ...     sensor=np.zeros(3, dtype=np.int16),
    ...     delay=np.zeros(3, dtype=np.float32),
    ...     intensity=np.full(3, 0.5, dtype=np.float32),
    ...     instance=np.array([7, 7, STATIC_INSTANCE], dtype=np.int32),
    ...     foreground=np.array([True, True, False]),
    ...     labels=car,
    ... )
    >>> frame.save("frame.npz")
    >>> read = Frame.load("frame.npz")
    >>> read.points[read.instance == read.labels.user[0]].tolist()
    [[9.75, 3.0, 0.5], [9.75, 3.25, 1.0]]
    """

    time: float
    points: NDArray[np.float32]
    sensor: NDArray[np.int16]
    delay: NDArray[np.float32]
    intensity: NDArray[np.float32]
    instance: NDArray[np.int32]
    foreground: Boolean
    labels: Labels

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.points)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the frame as npz: arrays by their names, those of the labels as ``labels.NAME``."""
        labels = {f"labels.{part.name}": getattr(self.labels, part.name) for part in fields(Labels)}
        FILE.save(path, {"time": self.time}, {name: getattr(self, name) for name in _POINTS} | labels)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Frame:
        """Read a frame.

        Raises
        ------
        SeipError
            The file is missing, damaged or not a frame.
        """
        with FILE.reading(path) as (header, arrays):
            labels = Labels(**{part.name: arrays[f"labels.{part.name}"] for part in fields(Labels)})
            return cls(time=float(header["time"]), labels=labels, **{name: arrays[name] for name in _POINTS})
