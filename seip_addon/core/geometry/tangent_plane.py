"""Latitudes and longitudes on the plane that touches the ellipsoid at a place."""

import math
from collections.abc import Sequence

import numpy as np

from ..base.arrays import Float

EQUATOR_RADIUS, ECCENTRICITY_SQUARED = 6_378_137.0, 0.00669437999014  # of WGS 84


def plan_metres(degrees: Float | Sequence[Sequence[float]], middle: Float | Sequence[float]) -> Float:
    """Return metres east and north of a place; within 10 km of it, distances are right to 0.2 %.

    The radii of curvature at the place are used throughout: one circle of latitude is as long as another. Of the two
    ways round the Earth the shorter is taken.

    Parameters
    ----------
    degrees : (n, 2) float64, or sequence of pairs
        Latitudes and longitudes.
    middle : (2,) float64
        Latitude and longitude of the place.

    Returns
    -------
    (n, 2) float64, metres
    """
    latitude = math.radians(float(middle[0]))
    flattened = 1.0 - ECCENTRICITY_SQUARED * math.sin(latitude) ** 2
    along_parallel = EQUATOR_RADIUS / math.sqrt(flattened) * math.cos(latitude)
    along_meridian = EQUATOR_RADIUS * (1.0 - ECCENTRICITY_SQUARED) / flattened**1.5
    away = np.array(degrees, dtype=np.float64).reshape(-1, 2) - np.asarray(middle)
    away[:, 1] -= 360.0 * np.round(away[:, 1] / 360.0)
    metres: Float = np.radians(away)[:, ::-1] * (along_parallel, along_meridian)
    return metres
