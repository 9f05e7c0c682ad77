"""Rank correlation of two figures."""

import numpy as np

from seip_addon.core.base.arrays import Float


def rank_correlation(x: Float, y: Float) -> float:
    """Return Spearman's rank correlation of two figures (n,); NaN if one of them is the same everywhere."""
    # The sum of a value's signs against all others is twice its centred rank; equal values share their mean rank.
    of_x, of_y = (np.sign(values[:, None] - values).sum(axis=1) for values in (x, y))
    scale = float(np.sqrt((of_x**2).sum() * (of_y**2).sum()))
    return float(of_x @ of_y) / scale if scale else float("nan")
