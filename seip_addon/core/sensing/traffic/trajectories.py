"""Trajectories of road users."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...base.arrays import Boolean, Float, Integer
from ...base.limits import MAP_COORDINATE, ROAD_USER_SIZE, SHARE, SPEED, TIME, UNWRAPPED_ANGLE, Limits
from ...storage.array_file import ArrayFile
from ...storage.files import digest

WARM_UP = 2.0  # seconds from the first sample of a run to the first instant that is used
MOST_DRIFT = 0.5  # largest movement of a parked road user along an axis during a run, metres
MAX_BEND = 0.6  # largest bend of the lines of a body along one axis

_TIME_TOLERANCE = 1e-6  # seconds
_ARRAYS = {
    "origin": "f8",
    "first": "i8",
    "time": "f8",
    "position": "f8",
    "yaw": "f8",
    "pitch": "f8",
    "speed": "f8",
}
FILE = ArrayFile("seip.trajectories", 2, "file of trajectories", "import or simulate them again", _ARRAYS)

SAMPLED = ("time", "position", "yaw", "pitch", "speed")
"""Arrays of `Trajectories` with a row for each sample."""

CATEGORIES = ("car", "van", "truck", "bus", "motorcycle", "bicycle", "pedestrian")  # categories of road users


@dataclass(frozen=True)
class RoadUser:
    """One road user and its size.

    Parameters
    ----------
    name : str
        Id in the simulation.
    category : str
        One of `CATEGORIES`.
    length, width, height : float, metres
        Dimensions.
    paint : float, 0 to 1
        Reflectivity of the painted parts, or of the clothes.
    shape : (4,) float
        Differences of the body's lines from those of the model, see `bent`: two numbers for the length and two for the
        height. The absolute values of each pair add up to at most `MAX_BEND`.
    """

    name: str
    category: str
    length: float
    width: float
    height: float
    paint: float = 0.5
    shape: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


def bent(share: Float, shift: float, spread: float) -> Float:
    """Return shares, 0 to 1, of a length after a cubic shift along it, which keeps both ends and the order.

    The slope of the cubic is at least 1 − |shift| − |spread|.

    Parameters
    ----------
    shift : float
        Shift of all shares forward; the middle moves by a quarter of this.
    spread : float
        Shift of shares below the middle backward, and of those above it forward.
    """
    middle = 2.0 * share - 1.0
    moved: Float = share + share * (1.0 - share) * (shift + spread * middle)
    return moved


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Positions and headings of the k road users present at one instant.

    Parameters
    ----------
    time : float, seconds
        Time of the instant.
    user : (k,) int64
        Index into the trajectories' road users, ascending.
    position : (k, 3) float64, metres
        Centre of each road user's underside, on the road, local site axes.
    yaw : (k,) float64, radians
        Heading, counter-clockwise from +x.
    pitch : (k,) float64, radians
        Pitch of the road under each road user, nose up positive.
    speed : (k,) float64, metres per second
        Speed of each road user.
    """

    time: float
    user: Integer
    position: Float
    yaw: Float
    pitch: Float
    speed: Float

    def __len__(self) -> int:
        return len(self.user)


@dataclass(frozen=True, eq=False)
class Trajectories:
    """Samples of all road users' motion, one road user after the other; n samples.

    Parameters
    ----------
    origin : (3,) float64, metres
        Map coordinates of the local origin: map = local + origin.
    first : (u + 1,) int64
        Samples of road user i are ``first[i]`` up to ``first[i + 1]``, one or more.
    time : (n,) float64, seconds
        Time of each sample, strictly increasing for each road user.
    position : (n, 3) float64, metres
        Centre of the underside, on the road, local site axes.
    yaw : (n,) float64, radians
        Heading counter-clockwise from +x, unwrapped: neighbouring samples never differ by more than π.
    pitch : (n,) float64, radians
        Pitch, nose up positive.
    speed : (n,) float64, metres per second
        Speed at each sample.
    source : str
        Source for messages: the file, or the simulation and its seed.

    Examples
    --------
    A car that drives east and a bus that drives west, with two samples each:

    >>> run = Trajectories(
    ...     users=(RoadUser("car 1", "car", 4.5, 1.8, 1.5), RoadUser("bus 1", "bus", 12.0, 2.5, 3.2)),
    ...     origin=np.zeros(3),
    ...     first=np.array([0, 2, 4]),
    ...     time=np.array([0.0, 4.0, 3.0, 9.0]),
    ...     position=np.array([[0.0, -2.0, 0.0], [40.0, -2.0, 0.0], [60.0, 2.0, 0.0], [0.0, 2.0, 0.0]]),
    ...     yaw=np.array([0.0, 0.0, np.pi, np.pi]),
    ...     pitch=np.zeros(4),
    ...     speed=np.full(4, 10.0),
    ... )
    >>> present = run.at(3.0)
    >>> [run.users[number].category for number in present.user], present.position[:, 0].tolist()
    (['car', 'bus'], [30.0, 60.0])
    """

    users: tuple[RoadUser, ...]
    origin: Float
    first: Integer
    time: Float
    position: Float
    yaw: Float
    pitch: Float
    speed: Float
    source: str = ""

    def __len__(self) -> int:
        return len(self.users)

    @cached_property
    def key(self) -> str:
        """Digest of sizes and motion, which does not depend on the names of the road users and of the source."""
        sizes = [_look(user) for user in self.users]
        return digest(repr(sizes), self.first, self.time, self.position, self.yaw, self.pitch, self.speed)

    @property
    def span(self) -> tuple[float, float]:
        """First and last time of any sample, seconds."""
        return float(self.time.min()), float(self.time.max())

    @property
    def description(self) -> str:
        """Name of the run in messages."""
        return f"the run of traffic ({self.source})" if self.source else "a run of traffic"

    def at(self, time: float) -> Snapshot:
        """Return the road users present at an instant, with positions interpolated linearly between samples.

        Parameters
        ----------
        time : float, seconds
            Time of the instant.

        Returns
        -------
        Snapshot
            Road users whose first sample is not later and whose last is not earlier.
        """
        begin, end = self.time[self.first[:-1]], self.time[self.first[1:] - 1]
        user = np.flatnonzero((begin <= time) & (time <= end))
        before = np.array([self._last_not_after(int(number), time) for number in user], dtype=np.int64)
        after = np.minimum(before + 1, self.first[user + 1] - 1)
        gap = self.time[after] - self.time[before]
        share = np.where(gap > 0, (time - self.time[before]) / np.where(gap > 0, gap, 1.0), 0.0)

        def between(values: Float) -> Float:
            part = share if values.ndim == 1 else share[:, None]
            moved: Float = values[before] + part * (values[after] - values[before])
            return moved

        return Snapshot(
            time=time,
            user=user,
            position=between(self.position),
            yaw=between(self.yaw),
            pitch=between(self.pitch),
            speed=between(self.speed),
        )

    def _last_not_after(self, user: int, time: float) -> int:
        begin, end = int(self.first[user]), int(self.first[user + 1])
        return begin + int(np.searchsorted(self.time[begin:end], time, side="right")) - 1

    def moved_to(self, origin: Float) -> Trajectories:
        """Return the same motion in the local axes of another origin."""
        return replace(self, origin=origin, position=self.position + (self.origin - origin))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the trajectories as npz: the arrays by their names, and the text ``header`` (JSON)."""
        header = {"source": self.source, "users": [_as_record(user) for user in self.users]}
        FILE.save(path, header, {name: getattr(self, name) for name in _ARRAYS})

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Trajectories:
        """Read trajectories.

        Raises
        ------
        SeipError
            The file is missing, damaged or not a file of trajectories.
        """
        with FILE.reading(path) as (header, arrays):
            users = tuple(_from_record(user) for user in header["users"])
            loaded = cls(users=users, source=str(header["source"]), **{name: arrays[name] for name in _ARRAYS})
            _check(loaded)
            return loaded


@dataclass(frozen=True, eq=False)
class LoadedTraffic:
    """Trajectories with warnings about them."""

    trajectories: Trajectories
    warnings: tuple[str, ...]


def some_users(trajectories: Trajectories, kept: Boolean) -> Trajectories:
    """Return the motion of the road users of a mask (u,)."""
    counts = np.diff(trajectories.first)
    samples = np.repeat(kept, counts)
    return replace(
        trajectories,
        users=tuple(user for user, here in zip(trajectories.users, kept.tolist(), strict=True) if here),
        first=np.concatenate([[0], np.cumsum(counts[kept])]).astype(np.int64),
        **{name: getattr(trajectories, name)[samples] for name in SAMPLED},
    )


def parked_users(trajectories: Trajectories) -> Boolean:
    """Return which road users stand still from the first sample of a run to the last, (u,) bool.

    Road users at a traffic light move before or after it, in runs that are longer than a red light.
    """
    begin, end = trajectories.span
    first, last = trajectories.first[:-1], trajectories.first[1:] - 1
    throughout = (trajectories.time[first] <= begin + _TIME_TOLERANCE) & (
        trajectories.time[last] >= end - _TIME_TOLERANCE
    )
    highest = np.maximum.reduceat(trajectories.position, first, axis=0)
    drift = (highest - np.minimum.reduceat(trajectories.position, first, axis=0)).max(axis=1)
    stands: Boolean = throughout & (drift < MOST_DRIFT)
    return stands


def _look(user: RoadUser) -> tuple[object, ...]:
    """Return the appearance of a road user, with its shape if that differs from the model's."""
    look = (user.category, user.length, user.width, user.height, user.paint)
    return (*look, user.shape) if any(user.shape) else look


def _as_record(user: RoadUser) -> dict[str, Any]:
    """Return a road user for a header, with its shape if that differs from the model's."""
    record = asdict(user)
    if not any(user.shape):
        del record["shape"]
    return record


def _from_record(record: dict[str, Any]) -> RoadUser:
    return RoadUser(**{**record, "shape": tuple(record.get("shape", RoadUser.shape))})


def is_shape(values: Sequence[object]) -> bool:
    """Return whether values are a shape of a road user."""
    bends = [abs(value) for value in values if isinstance(value, int | float)]
    return len(bends) == len(values) == 4 and sum(bends[:2]) <= MAX_BEND and sum(bends[2:]) <= MAX_BEND


def _check(run: Trajectories) -> None:
    """Raise ValueError if shapes contradict each other, or a number is not plausible or out of order."""
    samples = len(run.time)
    shapes = dict.fromkeys(SAMPLED, (samples,)) | {"position": (samples, 3), "origin": (3,)}
    shapes |= {"first": (len(run.users) + 1,)}
    wrong = [name for name, shape in shapes.items() if getattr(run, name).shape != shape]
    if wrong or run.first[0] != 0 or run.first[-1] != samples or (np.diff(run.first) < 1).any():
        raise ValueError(f"{(*wrong, 'first')[0]} does not fit the other arrays")
    steps = np.delete(np.diff(run.time), run.first[1:-1] - 1)
    sizes = [(user.length, user.width, user.height) for user in run.users]
    numbers = {
        "a time": (run.time, TIME),
        "a coordinate": (np.append(run.position, run.origin), MAP_COORDINATE),
        "an angle": (np.append(run.yaw, run.pitch), UNWRAPPED_ANGLE),
        "a speed": (run.speed, SPEED),
        "a size": (np.array(sizes, dtype=np.float64), ROAD_USER_SIZE),
        "a paint": (np.array([user.paint for user in run.users], dtype=np.float64), SHARE),
    }
    known = all(
        isinstance(user.name, str) and user.category in CATEGORIES and is_shape(user.shape) for user in run.users
    )
    if (fault := Limits.first_fault(numbers)) or (steps <= 0.0).any() or not known:
        raise ValueError(fault or "times do not increase, or a road user is of no known kind")
