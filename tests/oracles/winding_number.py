"""The winding number of each point from all triangles, without blocks."""

import numpy as np

from seip_addon.core.geometry.winding_number import _shares


def winding_number(points, triangles):
    """Return the winding number (n,) of points (n, 3) in a triangle soup (m, 3, 3)."""
    numbers = [_shares(triangles - point).sum() for point in points]
    return np.array(numbers, dtype=np.float64)
