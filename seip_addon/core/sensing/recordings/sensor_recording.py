"""The sweeps of one sensor, read one at a time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from ...base.arrays import Float
from .sweep import Sweep
from .sweep_files import read_sweep


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
        return replace(read_sweep(self.paths[number]), time=float(self.times[number]))
