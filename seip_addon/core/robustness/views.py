"""Visibility over scenarios: pose errors or instants of traffic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Boolean, Integer


@dataclass(frozen=True, eq=False)
class Views:
    """Which of s poses sees which of t targets in each of n circumstances.

    Parameters
    ----------
    packed : (n, s, ceil(t / 8)) uint8
        Bits of V, as `numpy.packbits` packs them.
    targets : int
        t.
    """

    packed: NDArray[np.uint8]
    targets: int

    def __len__(self) -> int:
        """Return the number of circumstances."""
        return len(self.packed)

    def seen(self, number: int) -> Boolean:
        """Return V in one circumstance, (s, t) bool."""
        return np.unpackbits(self.packed[number], axis=1, count=self.targets).view(bool)

    def seen_by_pose(self, pose: int) -> Boolean:
        """Return what one pose sees in each circumstance, (n, t) bool."""
        return np.unpackbits(self.packed[:, pose], axis=1, count=self.targets).view(bool)

    def seen_by_each(self, poses: Integer) -> NDArray[np.uint8]:
        """Return what a few poses see in each circumstance, (n, s, t) uint8."""
        return np.unpackbits(self.packed[:, poses], axis=2, count=self.targets)

    def seen_by_any(self, poses: Integer) -> Boolean:
        """Return what some of a few poses sees in each circumstance, (n, t) bool."""
        joined = np.bitwise_or.reduce(self.packed[:, poses], axis=1)
        return np.unpackbits(joined, axis=1, count=self.targets).view(bool)

    def spread_to(self, poses: Integer, number: int) -> Views:
        """Return views of that many poses, of which these are ``poses`` and the others see nothing."""
        packed = np.zeros((len(self), number, self.packed.shape[2]), dtype=np.uint8)
        packed[:, poses] = self.packed
        return Views(packed, self.targets)
