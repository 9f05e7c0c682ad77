"""Piecewise cubic profiles of OpenDRIVE: elevation, offsets and widths along a road."""

from dataclasses import dataclass

import numpy as np

from ...base.arrays import Float

_MIN_TERM = 1e-12  # terms of a cubic below this share of the largest one do not move its zeros noticeably
_MAX_IMAGINARY_PART = 1e-9  # imaginary parts below this come from rounding


@dataclass(frozen=True, eq=False)
class Profile:
    """Value ``a + b·ds + c·ds² + d·ds³`` with ``ds`` counted from the start of the record in force.

    A record is in force up to the start of the next one; of two with the same start, the later counts. Before the
    first record its first value holds, and without any record the value is zero.

    Parameters
    ----------
    start : (n,) float64, metres
        Start of each record along the road, ascending.
    coefficients : (n, 4) float64
        ``a, b, c, d`` of each record.
    """

    start: Float
    coefficients: Float

    def __len__(self) -> int:
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

    def zeros(self, end: float) -> Float:
        """Return where the values pass through zero before ``end``, (k,) metres along the road in any order."""
        span = np.append(self.start[1:], end) - self.start
        # Scaled to ds from 0 to 1, a cubic has no zero if its other terms together are smaller than the constant one.
        # This rules out nearly all records without solving them.
        scaled = self.coefficients * span[:, None] ** np.arange(4)
        may_cross = (span > 0.0) & (np.abs(scaled[:, 1:]).sum(axis=1) >= np.abs(scaled[:, 0]))
        found = [np.empty(0)]
        for record in np.flatnonzero(may_cross):
            cubic = np.where(np.abs(scaled[record]) > _MIN_TERM * np.abs(scaled[record]).max(), scaled[record], 0.0)
            roots = np.roots(cubic[::-1])
            share = roots[np.abs(roots.imag) < _MAX_IMAGINARY_PART].real
            found.append(self.start[record] + span[record] * share[(share > 0.0) & (share < 1.0)])
        return np.concatenate(found)

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


def linear_profile(start: Float, values: Float) -> Profile:
    """Return the profile that is linear between values (n,) at stations (n,) in metres along the road."""
    lengths = np.diff(start)
    slopes = np.divide(np.diff(values), lengths, out=np.zeros(len(lengths)), where=lengths > 0)
    return Profile(start[:-1], np.column_stack([values[:-1], slopes, np.zeros((len(slopes), 2))]))


ZERO_PROFILE = profile([])  # the profile without records: zero everywhere


@dataclass(frozen=True, eq=False)
class LateralShape:
    """Height of the road surface across the road, at stations along it and blended linearly in between.

    Before the first and after the last station the shape stays as it is there;
    without any station the road is flat across.

    Parameters
    ----------
    s : (n,) float64, metres
        Stations along the road, ascending.
    across : tuple of Profile
        Height over t at each station.
    """

    s: Float
    across: tuple[Profile, ...]

    def __call__(self, s: Float, t: Float) -> Float:
        """Return the heights, (k,) metres, at ``s`` along and ``t`` to the left, (k,) metres each."""
        if not self.across:
            return np.zeros_like(t)
        # Position among the stations: 2.25 is a quarter of the way from the third to the fourth.
        position = np.interp(s, self.s, np.arange(len(self.s)))
        heights = np.zeros_like(t)
        for station, height in enumerate(self.across):
            share = np.maximum(1.0 - np.abs(position - station), 0.0)
            near = share > 0.0
            heights[near] += share[near] * height(t[near])
        return heights


FLAT = LateralShape(np.empty(0), ())  # the shape of a road that is flat across


def lateral_shape(records: list[tuple[float, float, tuple[float, float, float, float]]]) -> LateralShape:
    """Return the shape of ``(s, t, (a, b, c, d))`` records in any order."""
    stations = sorted({s for s, _, _ in records})
    return LateralShape(
        np.array(stations, dtype=np.float64),
        tuple(profile([(t, cubic) for s, t, cubic in records if s == station]) for station in stations),
    )
