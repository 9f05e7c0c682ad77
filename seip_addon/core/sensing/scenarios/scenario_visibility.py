"""Visibility over scenarios: pose errors or instants of traffic."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Boolean, Integer
from ...base.progress import Progress

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class ScenarioVisibility:
    """Visibility grids of s poses and t targets in each of n scenarios.

    Parameters
    ----------
    packed : (n, s, ceil(t / 8)) uint8
        Bits of V, in the order of `numpy.packbits`.
    targets : int
        Number of targets, t.
    """

    packed: NDArray[np.uint8]
    targets: int

    def __len__(self) -> int:
        return len(self.packed)

    def seen(self, number: int) -> Boolean:
        """Return V in one scenario, (s, t) bool."""
        return np.unpackbits(self.packed[number], axis=1, count=self.targets).view(bool)

    def seen_by_each(self, poses: Integer) -> NDArray[np.uint8]:
        """Return the targets that some poses see in each scenario, (n, s, t) uint8."""
        return np.unpackbits(self.packed[:, poses], axis=2, count=self.targets)

    def seen_by_any(self, poses: Integer) -> Boolean:
        """Return the targets that at least one of some poses sees in each scenario, (n, t) bool."""
        joined = np.bitwise_or.reduce(self.packed[:, poses], axis=1)
        return np.unpackbits(joined, axis=1, count=self.targets).view(bool)


def each_in_threads(
    compute: Callable[[T], None], items: Sequence[T], threads: int, message: str
) -> Generator[Progress, None, None]:
    """Call a function for each item, several at once; closing the generator cancels calls that have not started."""
    pool = ThreadPoolExecutor(threads)
    try:
        for done, _ in enumerate(pool.map(compute, items)):
            yield Progress(done, len(items), message)
    finally:
        pool.shutdown(cancel_futures=True)
    yield Progress(len(items), len(items), message)
