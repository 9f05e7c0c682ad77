"""Squares of road around targets, draped over the road surface."""

from __future__ import annotations

import numpy as np

from ..base.arrays import Float
from .site import Targets


def target_squares(targets: Targets) -> Float:
    """Return the corners of a square around each target, draped over the slopes of the road.

    A corner shared by several squares has the mean height of their targets.

    Returns
    -------
    (t, 4, 3) float64, metres
        Corners counter-clockwise from the lower left.
    """
    half = targets.spacing / 2.0
    corners = targets.xyz[:, None, :2] + half * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    places = np.round(corners.reshape(-1, 2) / half).astype(np.int64)
    shared = np.unique(places, axis=0, return_inverse=True)[1].ravel()
    height = np.bincount(shared, np.repeat(targets.xyz[:, 2], 4)) / np.bincount(shared)
    squares: Float = np.concatenate((corners, height[shared].reshape(-1, 4, 1)), axis=2)
    return squares
