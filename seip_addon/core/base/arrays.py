"""Types of NumPy arrays by element, whose shapes and units are given in docstrings, and concatenated ranges."""

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Integer = NDArray[np.int64]
Boolean = NDArray[np.bool_]
Text = NDArray[np.str_]


def concatenated_ranges(first: Integer, count: Integer) -> Integer:
    """Return the ranges of ``count`` whole numbers from each ``first`` on, one after the other.

    Examples
    --------
    >>> concatenated_ranges(np.array([5, 0]), np.array([2, 3])).tolist()
    [5, 6, 0, 1, 2]
    """
    numbers: Integer = np.arange(count.sum()) + np.repeat(first - (np.cumsum(count) - count), count)
    return numbers
