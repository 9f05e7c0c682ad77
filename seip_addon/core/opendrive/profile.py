"""Piecewise cubic profiles: how OpenDRIVE gives elevation, offsets and widths along a road."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Profile:
    """Value ``a + b·ds + c·ds² + d·ds³`` with ``ds`` counted from the start of the record in force.

    A record is in force up to the start of the next one; of two that start at
    one place the later counts. Before the first record its first value holds,
    and without any record the value is zero.

    Parameters
    ----------
    start : (n,) float64, metres
        Where each record begins, ascending.
    coefficients : (n, 4) float64
        ``a, b, c, d`` of each record.
    """

    start: Float
    coefficients: Float

    def __len__(self) -> int:
        """Return the number of records."""
        return len(self.start)

    def __call__(self, s: Float) -> Float:
        """Return the values at ``s``, (k,) metres along the road."""
        if len(self) == 0:
            return np.zeros_like(s)
        (a, b, c, d), ds = self._in_force(s)
        return np.asarray(a + ds * (b + ds * (c + ds * d)))

    def slope(self, s: Float) -> Float:
        """Return the first derivatives at ``s``, (k,) metres along the road."""
        if len(self) == 0:
            return np.zeros_like(s)
        (_, b, c, d), ds = self._in_force(s)
        return np.asarray(b + ds * (2.0 * c + ds * 3.0 * d))

    def bound(self, end: float) -> float:
        """Return a number that no absolute value before ``end`` exceeds."""
        if len(self) == 0:
            return 0.0
        span = np.maximum(np.append(self.start[1:], end) - self.start, 0.0)
        return float((np.abs(self.coefficients) * span[:, None] ** np.arange(4)).sum(axis=1).max())

    def _in_force(self, s: Float) -> tuple[Float, Float]:
        record = np.maximum(np.searchsorted(self.start, s, side="right") - 1, 0)
        return self.coefficients[record].T, np.maximum(s - self.start[record], 0.0)


def profile(records: list[tuple[float, tuple[float, float, float, float]]]) -> Profile:
    """Return the profile of ``(start, (a, b, c, d))`` records in any order."""
    ordered = sorted(records, key=lambda record: record[0])
    return Profile(
        np.array([start for start, _ in ordered], dtype=np.float64),
        np.array([coefficients for _, coefficients in ordered], dtype=np.float64).reshape(-1, 4),
    )


NONE = profile([])
"""The profile without records: zero everywhere."""
