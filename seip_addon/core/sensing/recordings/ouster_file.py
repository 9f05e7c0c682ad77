"""Recordings of packets of Ouster sensors (pcap), read with ouster-sdk if it is installed."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...base.arrays import Float
from ...base.errors import SeipError
from ...storage.files import parse_json, read_small
from .sensor_recording import SensorRecording
from .sweep import Sweep, sweep_of

_MAX_METADATA_BYTES = 1 << 24
_INTENSITIES = ("REFLECTIVITY", "SIGNAL")  # fields of intensity, the preferred one first
_CURE = "record it again, with the metadata of the same sensor"


@dataclass(frozen=True, eq=False)
class OusterRecording(SensorRecording):
    """Sweeps in a recording of packets; each is decoded when it is asked for.

    Parameters
    ----------
    frames : PcapFrameSetSource
        Frames of the recording by number, in ouster-sdk.
    project : callable
        Projection of a frame to points (channels, columns, 3) in the sensor's axes.
    """

    frames: Any
    project: Any

    def sweep(self, number: int) -> Sweep:
        """Decode a sweep."""
        try:
            (frame,) = self.frames[number]
            xyz = np.asarray(self.project(frame)).reshape(-1, 3)
            columns = dict(zip("xyz", xyz.T, strict=True))
            if name := next((name for name in _INTENSITIES if name in frame.fields), None):
                columns["intensity"] = np.asarray(frame.field(name)).ravel()
        except Exception as error:  # whatever a damaged file makes of ouster-sdk
            raise _damaged(self.paths[0], error) from error
        columns["time"] = np.full(len(xyz), self.times[number])
        return sweep_of(self.paths[0].name, columns)


def open_ouster(path: Path) -> SensorRecording:
    """Open a pcap whose metadata are in the JSON file of the same name.

    Times are those of the first packet of each sweep, by the clock of the recording computer.

    Raises
    ------
    SeipError
        The metadata are missing, ouster-sdk is not installed, or the recording is damaged or has no sweeps.
    """
    metadata = path.with_suffix(".json")
    if not metadata.is_file():
        raise SeipError(f"{path.name} needs the sensor's metadata: put {metadata.name} into the same folder")
    text = read_small(metadata, _MAX_METADATA_BYTES, _CURE)
    try:
        parse_json(text)
    except (ValueError, RecursionError) as error:
        raise SeipError(f"{metadata.name} is not a sensor's metadata in JSON; {_CURE}") from error
    try:
        core, pcap = (importlib.import_module(f"ouster.sdk.{part}") for part in ("core", "pcap"))
    except ModuleNotFoundError as error:
        raise SeipError(
            f"reading {path.name} needs {error.name}, which is not installed; pip install ouster-sdk"
        ) from error
    try:
        info = core.SensorInfo(text.decode("utf-8"))
        frames = pcap.PcapFrameSetSource(str(path), sensor_info=[info], index=True)
        times: Float = np.array([frame.get_first_valid_packet_timestamp() for (frame,) in frames]) / 1e9
        project = core.XYZLut(info)
    except Exception as error:  # whatever a damaged file makes of ouster-sdk
        raise _damaged(path, error) from error
    if not len(times) or not (np.diff(times) > 0.0).all():
        raise _damaged(path, ValueError("it has no sweeps of this sensor in order of time"))
    return OusterRecording(path.stem, (path,), times, frames, project)


def _damaged(path: Path, error: Exception) -> SeipError:
    first = (str(error).strip().splitlines() or ["no reason given"])[0]
    return SeipError(f"{path.name} is not a readable recording of an Ouster sensor ({first[:150]}); {_CURE}")
