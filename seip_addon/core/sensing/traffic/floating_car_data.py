"""SUMO's floating car data (FCD): the position of each road user at each step of a simulation.

A vehicle's position is the centre of its front bumper, its angle is clockwise from north in degrees, and coordinates
are those of the network: the map's plus the network's offset (SUMO's documentation, "FCDOutput"). A person's position
is taken as the person's centre, as SUMO draws it.
"""

import math
import os
from array import array
from collections.abc import Generator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...base.arrays import Float, Integer
from ...base.counts import counted
from ...base.errors import SeipError
from ...base.limits import MAP_COORDINATE, SPEED, TIME
from ...base.progress import Progress
from ...storage.files import digest
from ...storage.xml_stream import Attributes, quoted, read_tags, short
from .trajectories import LoadedTraffic, RoadUser, Trajectories
from .vehicle_types import CAR, PERSON, VehicleType

_MAX_NAMED = 5  # largest number of road users named in a message, which gives the number of the others


class Extent(NamedTuple):
    """Part of a file to read: a span of the simulation in seconds, and a rectangle of the map in metres.

    The span ends ``duration`` after it begins, or after the first step of the file if it has no beginning.
    """

    begin: float = -math.inf
    end: float = math.inf
    bounds: tuple[float, float, float, float] = (-math.inf, -math.inf, math.inf, math.inf)
    duration: float = math.inf


def read_floating_car_data(
    path: str | os.PathLike[str],
    types: Mapping[str, VehicleType],
    origin: Float,
    source: str,
    net_offset: Float | None = None,
    window: Extent | None = None,
) -> Generator[Progress, None, LoadedTraffic]:
    """Read floating car data as XML, with or without gzip.

    Parameters
    ----------
    types : mapping of str to VehicleType
        Vehicle types by id, from `read_vehicle_types`.
    origin : (3,) float64, metres
        Map coordinates of the local origin.
    source : str
        Source of the trajectories, for messages.
    net_offset : (2,) float64, metres, optional
        Offset of the network: map = network − offset.
    window : Extent, optional
        Part of the file to keep in memory.

    Returns
    -------
    LoadedTraffic
        Trajectories that are not fitted to the road yet: pitch is zero, and heights are those of the file or NaN. Its
        warnings are about road users without a size, and about persons in vehicles, who are left out.

    Raises
    ------
    SeipError
        The file cannot be read, has other contents or is incomplete, its times decrease, a number is invalid, or no
        road user is in the window.
    """
    rows = _Rows(Path(path).name, np.zeros(2) if net_offset is None else net_offset, window or Extent())
    yield from read_tags(path, rows.take)
    return rows.gathered(types, origin, source)


def listed(names: Sequence[str]) -> str:
    """Return the first few names, and the number of the others."""
    more = len(names) - _MAX_NAMED
    return ", ".join(short(name) for name in names[:_MAX_NAMED]) + (f" and {more} more" if more > 0 else "")


def unwrapped(yaw: Float, first: Integer) -> Float:
    """Return headings with whole turns added so that neighbouring samples of a road user differ by at most π.

    Parameters
    ----------
    yaw : (n,) float64, radians
        Headings.
    first : (u + 1,) int64
        Index of the first sample of each road user.

    Returns
    -------
    (n,) float64, radians
        Unwrapped headings; the first one of each road user does not change.
    """
    if not len(yaw):
        return yaw
    turns = np.concatenate([[0.0], -np.round(np.diff(yaw) / (2.0 * np.pi))])
    turns[first[:-1]] = 0.0
    sums = np.cumsum(turns)
    whole: Float = yaw + 2.0 * np.pi * (sums - np.repeat(sums[first[:-1]], np.diff(first)))
    return whole


class _Rows:
    """Reader of the rows of a file, which are stored in compact columns."""

    def __init__(self, file: str, net_offset: Float, window: Extent) -> None:
        self._file = file
        self._window, self._end = window, window.end
        self._shift_x, self._shift_y = net_offset.tolist()
        self._numbers: dict[tuple[str, bool], int] = {}  # a vehicle and a person may share an id
        self._types: list[str] = []
        self._outside: set[tuple[str, bool]] = set()
        self._steps = 0
        self._time = -math.inf
        self._vehicles_here: set[tuple[str, str]] = set()  # places of vehicles in this step, as the file writes them
        self._persons_here: list[tuple[str, tuple[str, str]]] = []
        self._riders: set[str] = set()
        self._user = array("q")
        self._columns = [array("d") for _ in range(6)]

    def take(self, tag: str, attributes: Attributes) -> None:
        """Read an element of the XML file."""
        if tag == "timestep":
            self.begin(attributes.get("time", ""))
        elif tag in ("vehicle", "person") and self._steps:
            self.add(attributes, walks=tag == "person")

    def begin(self, text: str) -> None:
        """Begin a step of the simulation."""
        time = self._number(text, "time", "a time step", TIME.most)
        if time < self._time:
            raise SeipError(
                f"{self._file}: times run backwards, {time:g} s comes after {self._time:g} s; "
                "use the output of a single simulation, in its order"
            )
        if not self._steps:
            begin = self._window.begin if math.isfinite(self._window.begin) else time
            self._end = min(self._window.end, begin + self._window.duration)
        if time > self._time:
            self._note_riders()
        self._time = time
        self._steps += 1

    def _note_riders(self) -> None:
        """Note the persons of the step before that are in vehicles: they have the place of one."""
        self._riders |= {name for name, place in self._persons_here if place in self._vehicles_here}
        self._vehicles_here.clear()
        self._persons_here.clear()

    def add(self, row: Attributes, *, walks: bool) -> None:
        """Add the position of a road user."""
        if not self._window.begin <= self._time <= self._end:
            return
        name, place = row.get("id", ""), (row.get("x", ""), row.get("y", ""))
        x, y = (self._number(text, axis, name, MAP_COORDINATE.most) for text, axis in zip(place, "xy", strict=True))
        speed = self._number(row.get("speed") or "0", "speed", name, SPEED.most)
        x, y = x - self._shift_x, y - self._shift_y
        if walks:
            self._persons_here.append((name, place))
        else:
            self._vehicles_here.add(place)
        left, low, right, high = self._window.bounds
        key = (name, walks)
        if not (left <= x <= right and low <= y <= high):
            self._outside.add(key)
            return
        if key not in self._numbers:
            self._numbers[key] = len(self._numbers)
            self._types.append(row.get("type", ""))
        self._user.append(self._numbers[key])
        z = row.get("z") or "nan"
        values = (
            self._time,
            x,
            y,
            math.nan if z == "nan" else self._number(z, "z", name, MAP_COORDINATE.most),
            self._number(row.get("angle", ""), "angle", name, 1e4),
            speed,
        )
        for column, value in zip(self._columns, values, strict=True):
            column.append(value)

    def gathered(self, types: Mapping[str, VehicleType], origin: Float, source: str) -> LoadedTraffic:
        """Return the rows as trajectories, in the order in which road users appear; see `read_floating_car_data`."""
        if not self._steps:
            raise SeipError(
                f"{self._file} is not floating car data: it has no time steps; use the output of SUMO's --fcd-output"
            )
        self._note_riders()
        keys = [key for key in self._numbers if not (key[1] and key[0] in self._riders)]
        if not keys:
            elsewhere = len(self._outside.difference(self._numbers))
            raise SeipError(
                f"FCD of another map, or of another time: none of the {elsewhere} road users in {source} comes near "
                "the scene's road; simulate on the scene's own map, without --fcd-output.geo, and name its .net.xml "
                "where that has a netOffset"
            )
        numbers = np.full(len(self._numbers), -1)
        numbers[np.array([self._numbers[key] for key in keys], dtype=np.int64)] = np.arange(len(keys))
        user = numbers[np.frombuffer(self._user, dtype=np.int64)]
        order = np.argsort(user, kind="stable")[np.count_nonzero(user < 0) :]  # riders come first
        user = user[order]
        time, x, y, z, angle, speed = (np.array(column, dtype=np.float64)[order] for column in self._columns)
        vehicles = {name for name, walks in keys if not walks}
        names = [f"person {name}" if walks and name in vehicles else name for name, walks in keys]
        twice = (np.diff(user) == 0) & (np.diff(time) <= 0)
        if twice.any():
            number = int(np.flatnonzero(twice)[0])
            raise SeipError(
                f"{self._file}: road user {quoted(names[user[number]])} appears twice at {time[number]:g} s; "
                "use the output of a single simulation"
            )
        first = np.searchsorted(user, np.arange(len(names) + 1)).astype(np.int64)
        yaw = unwrapped(np.radians(90.0 - angle), first)
        kinds = [self._types[self._numbers[key]] for key in keys]
        sizes = [types.get(kind, PERSON if walks else CAR) for kind, (_, walks) in zip(kinds, keys, strict=True)]
        half = [0.0 if walks else size.length / 2.0 for size, (_, walks) in zip(sizes, keys, strict=True)]
        heading = np.stack([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)], axis=1)
        trajectories = Trajectories(
            users=tuple(
                RoadUser(name, size.category, size.length, size.width, size.height, _paint(name))
                for name, size in zip(names, sizes, strict=True)
            ),
            origin=origin,
            first=first,
            time=time,
            position=np.stack([x, y, z], axis=1) - np.repeat(half, np.diff(first))[:, None] * heading - origin,
            yaw=yaw,
            pitch=np.zeros_like(yaw),
            speed=speed,
            source=source,
        )
        unknown = [name for name, kind in zip(names, kinds, strict=True) if kind not in types]
        riders = counted(len(self._numbers) - len(keys), "person in a vehicle", "persons in vehicles")
        left_out = (f"left out: {riders}",) if len(self._numbers) > len(keys) else ()
        return LoadedTraffic(trajectories, (*_missing_sizes(unknown, len(names)), *left_out))

    def _number(self, text: str, what: str, where: str, most: float) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not abs(value) <= most:
            known = f" at {self._time:g} s" if math.isfinite(self._time) else ""
            fault = f"is beyond {most:g}" if math.isfinite(value) else "is not a number"
            raise SeipError(
                f"{self._file}: {what}={quoted(text)} of {quoted(where)}{known} {fault}; write the file again"
            )
        return value


def _paint(name: str) -> float:
    """Return the reflectivity of a road user's paint, from dark to white; it depends on the name only."""
    share = int(digest(name)[:8], 16) / 0xFFFFFFFF
    return round(0.1 + 0.7 * share, 3)


def _missing_sizes(unknown: list[str], count: int) -> tuple[str, ...]:
    if not unknown:
        return ()
    one = len(unknown) == 1
    sentence = (
        f"missing sizes: {len(unknown)} of {counted(count, 'road user')} {'is' if one else 'are'} of no known vehicle "
        f"type ({listed(unknown)}) and {'gets' if one else 'get'} SUMO's default, "
        f"for vehicles {CAR.length:g} × {CAR.width:g} × {CAR.height:g} m; name their route file"
    )
    return (sentence,)
