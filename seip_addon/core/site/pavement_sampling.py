"""Sampling of an area in plan by points as close to each other as a least distance allows."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..base.arrays import Float, Integer
from ..base.errors import SeipError

_FINE_STEPS = 8
"""Fine grid steps per candidate spacing: a strip wider than an eighth of it gets candidates."""

_TILE = 128
"""Columns and rows of a tile of the fine grid."""

MAX_POSITIONS = 20_000
"""Limit on positions: rays are cast from each at every height with every type."""


def spread(area: BaseGeometry, spacing: float) -> Float:
    """Sample an area with points at least ``spacing`` apart, without room for another one.

    A maximal Poisson-disc sample drawn from a fine grid in order of x, then y: deterministic, uniform on wide areas,
    and evenly spaced along narrow strips, which a plain grid of that spacing would hit or miss by chance.

    Parameters
    ----------
    area : shapely geometry
        Area in plan, metres.
    spacing : float, metres
        Least distance between two points.

    Returns
    -------
    (n, 2) float64, metres

    Raises
    ------
    SeipError
        The spacing is far too small for the area.
    """
    if area.is_empty:
        return np.empty((0, 2))
    if area.area / spacing**2 > MAX_POSITIONS:
        raise SeipError(
            f"a candidate spacing of {spacing:g} m would lay about {area.area / spacing**2:,.0f} positions on "
            f"{area.area:,.0f} m²; choose a wider one (at most {MAX_POSITIONS:,} positions)"
        )
    step = spacing / _FINE_STEPS
    low_x, low_y, high_x, high_y = area.bounds
    x, y = np.arange(low_x + step / 2, high_x, step), np.arange(low_y + step / 2, high_y, step)
    if not len(x) or not len(y):
        return np.empty((0, 2))
    fine = _grid_points_within(area, x, y, step)
    points = np.column_stack((x[fine // len(y)], y[fine % len(y)]))
    free = np.ones(len(fine), dtype=bool)
    ahead = np.arange(_FINE_STEPS + 1) * len(y)  # offsets to the columns from a point's own onwards within the spacing
    taken = []
    at = 0
    # Take the first free grid point, and block those within the spacing around it. Points before it in the order are
    # taken or blocked already, so that only its own and the following columns need to be searched.
    while at < len(fine) and free[at:].any():
        at += int(np.argmax(free[at:]))
        taken.append(at)
        middle = fine[at] + ahead
        begin = np.searchsorted(fine, middle - _FINE_STEPS)
        end = np.searchsorted(fine, middle + _FINE_STEPS, side="right")
        around = np.concatenate([np.arange(*ends) for ends in zip(begin, end, strict=True)])
        free[around] &= np.hypot(*(points[around] - points[at]).T) >= spacing * (1 - 1e-9)
    return points[taken]


def _grid_points_within(area: BaseGeometry, x: Float, y: Float, step: float) -> Integer:
    """Return the indices (n,) of grid points in an area, ``column * len(y) + row``, in ascending order.

    Only tiles of the grid that meet the area are tested, so that the time grows with the area and the length of its
    edge, not with its extent.
    """
    shapely.prepare(area)
    tiles = np.array([[0, len(x), 0, len(y)]])
    found = [np.empty(0, dtype=np.int64)]
    while len(tiles):
        left, right, bottom, top = tiles.T
        boxes = shapely.box(x[left] - step, y[bottom] - step, x[right - 1] + step, y[top - 1] + step)
        tiles = tiles[shapely.intersects(area, boxes)]
        small = (tiles[:, 1] - tiles[:, 0] <= _TILE) & (tiles[:, 3] - tiles[:, 2] <= _TILE)
        for first, last, low, high in tiles[small].tolist():
            column, row = (part.ravel() for part in np.mgrid[first:last, low:high])
            inside = shapely.intersects_xy(area, x[column], y[row])
            found.append((column * len(y) + row)[inside])
        tiles = _quarters(tiles[~small])
    points: Integer = np.sort(np.concatenate(found))
    return points


def _quarters(tiles: Integer) -> Integer:
    """Divide tiles (n, 4), ranges of columns and rows with ends excluded, into their non-empty quarters."""
    left, right, bottom, top = tiles.T
    column, row = (left + right) // 2, (bottom + top) // 2
    parts = [
        np.column_stack((*columns, *rows))
        for columns in ((left, column), (column, right))
        for rows in ((bottom, row), (row, top))
    ]
    quarters = np.concatenate(parts)
    some: Integer = quarters[(quarters[:, 1] > quarters[:, 0]) & (quarters[:, 3] > quarters[:, 2])]
    return some
