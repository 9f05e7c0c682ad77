"""Visibility over scenarios: pose errors or instants of traffic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Boolean, Integer


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
