"""Recordings: folders of sweeps of one or several sensors."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from ...base.arrays import Float, Integer
from ...base.errors import SeipError
from ...base.limits import FRAMES, ROTATION_RATE, TIME
from ...storage.files import natural_order, read_small
from .sweep_files import Sweep, read_sweep, sweep_suffix

MERGED = "merged"  # folder of the clouds of all sensors together, in datasets of `seip simulate --format pcd`
TIMES_FILE = "timestamps.txt"

_MAX_TIMES_BYTES = 1 << 26
_UNIX_TIME = re.compile(
    r"(?<![0-9])(?:([0-9]{10})(?:\.([0-9]{1,9})|_([0-9]{9}))|([0-9]{13}|[0-9]{16}|[0-9]{19}))(?![0-9])"
)
"""Unix time in a file name: seconds with decimals, seconds_nanoseconds, or milli-, micro- or nanoseconds."""


@dataclass(frozen=True, eq=False)
class SensorRecording:
    """Sweeps of one sensor in order of time; each is read when it is asked for.

    Parameters
    ----------
    name : str
        Name of the sensor.
    paths : tuple of Path
        File of each sweep.
    times : (m,) float64, seconds
        Time of each sweep, strictly increasing.
    """

    name: str
    paths: tuple[Path, ...]
    times: Float

    def __len__(self) -> int:
        return len(self.times)

    def sweep(self, number: int) -> Sweep:
        """Read a sweep.

        Raises
        ------
        SeipError
            Its file is damaged.
        """
        return read_sweep(self.paths[number])


@dataclass(frozen=True, eq=False)
class Recording:
    """Sweeps of one or several sensors.

    Parameters
    ----------
    name : str
        Name of the recording: that of its folder or file.
    sensors : tuple of SensorRecording
        The sensors in natural order of their names.
    """

    name: str
    sensors: tuple[SensorRecording, ...]


def open_recording(path: Path, rate: float) -> Recording:
    """Open a recording without reading its sweeps.

    A folder of sweeps, or one sweep, is one sensor; a folder of folders is one sensor for each sub-folder with sweeps,
    except `MERGED`. Times of sweeps are those of `TIMES_FILE` (on each line a number of
    seconds, or a time in ISO 8601), otherwise the Unix times in the names of the files, otherwise number / rate.

    Parameters
    ----------
    rate : float, hertz
        Sweeps per second where neither file nor names give times.

    Raises
    ------
    SeipError
        There are no sweeps, or several formats in a folder, or times that do not increase.
    """
    ROTATION_RATE.require(rate, "recording", "rate")
    if not path.exists():
        raise SeipError(f"no such file or folder: {path}; check its path")
    if path.is_file():
        if not sweep_suffix(path):
            raise SeipError(f"{path.name} is not a recording: give a folder of sweeps, or a sweep")
        return Recording(path.stem, (SensorRecording(path.stem, (path,), np.zeros(1)),))
    sweeps, folders = _content(path)
    if sweeps:
        return Recording(path.name, (_sensor(path.name, sweeps, rate),))
    found = {folder.name: _content(folder)[0] for folder in folders if folder.name.lower() != MERGED}
    sensors = tuple(_sensor(name, paths, rate) for name, paths in found.items() if paths)
    if not sensors:
        raise SeipError(f"{path} has no sweeps: name a folder of .pcd, .bin or .npz files")
    return Recording(path.name, sensors)


def _content(folder: Path) -> tuple[list[Path], list[Path]]:
    """Return the sweeps and the folders in a folder, each in natural order."""
    try:
        entries = sorted((one for one in folder.iterdir() if not one.name.startswith(".")), key=natural_order)
        return [one for one in entries if sweep_suffix(one) and one.is_file()], [one for one in entries if one.is_dir()]
    except OSError as error:
        raise SeipError(
            f"cannot read {folder}: {error.strerror or error}; check that it is a readable folder"
        ) from error


def _sensor(name: str, paths: Sequence[Path], rate: float) -> SensorRecording:
    folder = paths[0].parent
    suffixes = sorted({sweep_suffix(path) for path in paths})
    if len(suffixes) > 1:
        raise SeipError(
            f"{folder} has sweeps of several formats, {suffixes[0]} and {suffixes[1]}: leave one of them in the folder"
        )
    FRAMES.require(len(paths), folder, "number of sweeps", "split the recording")
    listed = folder / TIMES_FILE
    if listed.is_file():
        times = _times_of_file(listed)
        if len(times) != len(paths):
            raise SeipError(f"{listed} has {len(times):,} times for {len(paths):,} sweeps: give one for each")
        TIME.require(times, listed, "time of a sweep")
    elif (named := _times_of_names(paths)) is not None:
        # by time: as numbers, decimals without trailing zeros are out of order
        order = np.argsort(named, kind="stable")
        times, paths = named[order], [paths[number] for number in order]
    else:
        times = np.arange(len(paths)) / rate
    late = np.flatnonzero(np.diff(times) <= 0.0)
    if len(late):
        before, after = paths[late[0]].name, paths[late[0] + 1].name
        raise SeipError(
            f"{folder}: the time of {after} is not after that of {before}; correct {TIMES_FILE} or the names"
        )
    return SensorRecording(name, tuple(paths), times)


def _times_of_file(path: Path) -> Float:
    try:
        lines = read_small(path, _MAX_TIMES_BYTES, "give one time for each sweep").decode("utf-8-sig").split("\n")
        return np.array([_seconds(line.strip()) for line in lines if line.strip()], dtype=np.float64)
    except ValueError as error:
        raise SeipError(f"{path} has a line that is neither seconds nor a time in ISO 8601: {error}") from error


def _seconds(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        moment = datetime.fromisoformat(text)
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()


def _times_of_names(paths: Sequence[Path]) -> Float | None:
    """Return the Unix times in the names of files, None if the names have none."""
    found = [_UNIX_TIME.search(path.name.removesuffix(sweep_suffix(path))) for path in paths]
    known = [match for match in found if match]
    if known and len(known) < len(found):
        odd = next(path for path, match in zip(paths, found, strict=True) if not match)
        raise SeipError(f"{odd} has no time in its name, as other sweeps have: move it away, or write {TIMES_FILE}")
    return np.array([_unix_seconds(match) for match in known]) if known else None


def _unix_seconds(match: re.Match[str]) -> float:
    seconds, decimals, nanoseconds, whole = match.groups()
    return float(f"{seconds}.{decimals or nanoseconds}") if seconds else int(whole) / 10 ** (len(whole) - 10)


def paired(recording: Recording) -> list[tuple[int | None, ...]]:
    """Pair the sweeps of all sensors by time.

    Sweeps within half a period of the sensor with the most sweeps belong together, nearest first; a sweep without a
    partner stands alone.

    Returns
    -------
    list of tuple of int or None
        Number of each sensor's sweep, or None, in order of time.

    Raises
    ------
    SeipError
        Two sensors have no time in common.
    """
    sensors = recording.sensors
    order = sorted(range(len(sensors)), key=lambda number: -len(sensors[number]))
    times = sensors[order[0]].times
    half = float(np.median(np.diff(times))) / 2 if len(times) > 1 else np.inf
    table = np.full((len(times), len(sensors)), -1)
    table[:, order[0]] = np.arange(len(times))
    for number in order[1:]:
        own = sensors[number].times
        row = _nearest(times, own)
        mutual = (_nearest(own, times)[row] == np.arange(len(own))) & (np.abs(times[row] - own) <= half)
        if not mutual.any():
            raise SeipError(
                f"{sensors[order[0]].name} and {sensors[number].name} have no time in common: check their clocks, or "
                f"write {TIMES_FILE} for each"
            )
        table[row[mutual], number] = np.flatnonzero(mutual)
        alone = np.full((len(own), len(sensors)), -1)
        alone[:, number] = np.arange(len(own))
        times, table = np.concatenate([times, own[~mutual]]), np.concatenate([table, alone[~mutual]])
        by_time = np.argsort(times, kind="stable")
        times, table = times[by_time], table[by_time]
    return [tuple(None if sweep < 0 else sweep for sweep in row) for row in table.tolist()]


def _nearest(times: Float, others: Float) -> Integer:
    """Return for each of some times the number of the nearest of ``times``, which increase."""
    return np.searchsorted((times[1:] + times[:-1]) / 2, others)
