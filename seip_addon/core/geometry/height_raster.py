"""Heights on a square grid, with interpolation, smoothing and filling of holes."""

from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Float

_REACH = 3.0  # standard deviations at which a Gaussian is cut off
_MIN_WEIGHT = 1e-3  # least share of a Gaussian's weight on known heights


@dataclass(frozen=True, eq=False)
class HeightRaster:
    """Heights on a square grid along the axes.

    Parameters
    ----------
    low : (2,) float64, metres
        Position of the first height.
    step : float, metres
        Distance between neighbouring heights.
    heights : (rows, columns) float64, metres
        Heights; rows go north, columns east, NaN if unknown.
    """

    low: Float
    step: float
    heights: Float

    @property
    def places(self) -> Float:
        """Positions of all heights, (rows × columns, 2) metres, row by row."""
        rows, columns = self.heights.shape
        x = self.low[0] + self.step * np.arange(columns)
        y = self.low[1] + self.step * np.arange(rows)
        return np.column_stack([np.tile(x, rows), np.repeat(y, columns)])

    def at(self, xy: Float) -> Float:
        """Return heights (n,) at places (n, 2), metres, by bilinear interpolation; beyond the edge as at the edge."""
        most = np.array(self.heights.shape[::-1]) - 1.0
        column, row = np.clip((xy - self.low) / self.step, 0.0, most).T
        return bilinear(self.heights, row, column)

    def smoothed(self, sigma: float) -> "HeightRaster":
        """Return the heights smoothed by a Gaussian with a standard deviation in metres, over the known heights.

        A plane stays a plane. If there are no known heights within reach, the Gaussian is widened until there are.
        """
        known = np.isfinite(self.heights)
        heights = np.full(self.heights.shape, np.nan)
        while not np.isfinite(heights).all() and known.any():
            # Normalised convolution: blur the heights, with unknown ones as zero, and the mask of known ones, and
            # divide. Cells that the mask does not reach are filled in a later round with twice the width.
            weight = _blurred(known.astype(np.float64), sigma / self.step)
            total = _blurred(np.where(known, self.heights, 0.0), sigma / self.step)
            fresh = np.isnan(heights) & (weight > _MIN_WEIGHT)
            heights[fresh] = total[fresh] / weight[fresh]
            sigma *= 2
        return replace(self, heights=heights)


def bilinear(values: Float, row: Float, column: Float) -> Float:
    """Return values (n,) of a grid at fractional rows and columns (n,), by bilinear interpolation."""
    above = np.minimum(row.astype(np.int64), max(values.shape[0] - 2, 0))
    left = np.minimum(column.astype(np.int64), max(values.shape[1] - 2, 0))
    below, right = (np.minimum(place + 1, size - 1) for place, size in zip((above, left), values.shape, strict=True))
    down, across = row - above, column - left
    upper = values[above, left] * (1 - across) + values[above, right] * across
    lower = values[below, left] * (1 - across) + values[below, right] * across
    found: Float = upper * (1 - down) + lower * down
    return found


def _blurred(values: Float, sigma: float) -> Float:
    """Return a grid convolved with a normalised Gaussian, with zeros beyond its edges; sigma in steps."""
    reach = max(int(np.ceil(_REACH * sigma)), 1)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    kernel /= kernel.sum()
    # The Gaussian is separable: convolve along one axis, transpose, and do the same again.
    for _ in range(2):
        size = values.shape[0]
        padded = np.pad(values, ((reach, reach), (0, 0)))
        values = sum(weight * padded[place : place + size] for place, weight in enumerate(kernel)).T
    return values
