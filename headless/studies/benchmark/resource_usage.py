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
        Processor time of all threads and processes together.
    wall : float, seconds
        Wall-clock time.
    """

    cpu: float = 0.0
    wall: float = 0.0

    def time(self, work: Callable[[], Result]) -> Result:
        """Return the result of ``work`` and add its cost."""
        cpu, wall = _processor_seconds(), time.perf_counter()
        result = work()
        self.cpu += _processor_seconds() - cpu
        self.wall += time.perf_counter() - wall
        return result


def peak_memory(work: Callable[[], Result]) -> tuple[Result, float | None]:
    """Return the result of ``work`` and the growth of the process in MB; None for the growth except on Linux.

    In a process that did other work before, memory that it still holds hides a part of the growth.
    """
    try:
        (_PROCESS / "clear_refs").write_text("5", encoding="ascii")  # sets the peak to what is in use now
        before = _kilobytes("VmRSS")
    except OSError:
        return work(), None
    result = work()
    return result, (_kilobytes("VmHWM") - before) / 1024


def _processor_seconds() -> float:
    """Return the processor time of this process and its ended children, seconds; nanosecond steps for this process."""
    times = os.times()
    return time.process_time() + times.children_user + times.children_system


def _kilobytes(entry: str) -> int:
    lines = (_PROCESS / "status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(f"{entry}:"))
