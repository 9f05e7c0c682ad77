"""Points spread over an area in plan, evenly and as close as they may stand."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from .arrays import Float
from .errors import SeipError

_FINE_STEPS = 8
"""Fine grid steps per candidate spacing: a strip wider than an eighth of it gets candidates."""

MOST_POINTS = 20_000
"""More positions than these are a slip of the keyboard: each is cast from at every height with every type."""


def spread(area: BaseGeometry, spacing: float) -> Float:
    """Spread points over an area, none closer than ``spacing`` and no room left for another.

    A maximal Poisson-disc sample drawn from a fine grid in order of x, then y:
    deterministic, uniform on wide areas, and evenly spaced along narrow strips,
    which a plain grid of that spacing would hit or miss by chance.

    Parameters
    ----------
    area : shapely geometry
        In plan, metres.
    spacing : float, metres

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
    if area.area / spacing**2 > MOST_POINTS:
        raise SeipError(
            f"a candidate spacing of {spacing:g} m would lay about {area.area / spacing**2:,.0f} positions on "
            f"{area.area:,.0f} m²; choose a wider one (at most {MOST_POINTS:,} positions)"
        )
    step = spacing / _FINE_STEPS
    low_x, low_y, high_x, high_y = area.bounds
    axes = (np.arange(low_x + step / 2, high_x, step), np.arange(low_y + step / 2, high_y, step))
    x, y = (values.ravel() for values in np.meshgrid(*axes, indexing="ij"))
    shapely.prepare(area)
    inside = shapely.intersects_xy(area, x, y)
    fine = np.column_stack((x[inside], y[inside]))
    taken = []
    free = np.ones(len(fine), dtype=bool)
    while free.any():
        point = fine[np.argmax(free)]
        taken.append(point)
        free &= np.hypot(*(fine - point).T) >= spacing * (1 - 1e-9)
    return np.array(taken).reshape(-1, 2)
