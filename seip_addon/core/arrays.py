"""Type aliases of NumPy arrays by element type; docstrings give shapes and units."""

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Integer = NDArray[np.int64]
Boolean = NDArray[np.bool_]
Text = NDArray[np.str_]
