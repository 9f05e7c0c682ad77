"""Processor time, wall-clock time and peak memory of a piece of work."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

Result = TypeVar("Result")

_PROCESS = Path("/proc/self")


@dataclass
class Expense:
    """Processor and wall-clock time of work, summed over its parts.

    Parameters
    ----------
    cpu : float, seconds
        Of processor time, all threads and processes together.
    wall : float, seconds
    """

    cpu: float = 0.0
    wall: float = 0.0

    def time(self, work: Callable[[], Result]) -> Result:
        """Return what ``work`` returns and add its cost."""
        cpu, wall = _processor_seconds(), time.perf_counter()
        result = work()
        self.cpu += _processor_seconds() - cpu
        self.wall += time.perf_counter() - wall
        return result


def peak_memory(work: Callable[[], Result]) -> tuple[Result, float | None]:
    """Return what ``work`` returns, and by how many MB the process grew for it; None where Linux does not tell.

    In a process that did other work before, memory that it kept from then hides a part.
    """
    try:
        (_PROCESS / "clear_refs").write_text("5", encoding="ascii")  # sets the peak to what is in use now
        before = _kilobytes("VmRSS")
    except OSError:
        return work(), None
    result = work()
    return result, (_kilobytes("VmHWM") - before) / 1024


def _processor_seconds() -> float:
    """Of this process and of its ended children, in nanosecond steps for the process itself."""
    times = os.times()
    return time.process_time() + times.children_user + times.children_system


def _kilobytes(entry: str) -> int:
    lines = (_PROCESS / "status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(f"{entry}:"))
