"""Rank correlations of two figures."""

import numpy as np

from seip_addon.core.base.arrays import Float


def rank_agreements(x: Float, y: Float) -> tuple[Float, Float]:
    """Return Spearman's and Kendall's (tau-b, 1945) rank correlation along the last axis; NaN if all are equal.

    Both follow from the signs of all pairwise differences; equal values share their mean rank.

    Parameters
    ----------
    x, y : (…, n) float64

    Returns
    -------
    spearman, kendall : (…) float64
    """
    # The sum of a value's signs against all others is twice its centred rank: hence Spearman's from the sums, and
    # Kendall's from the signs themselves.
    of_x, of_y = (np.sign(values[..., :, None] - values[..., None, :]) for values in (x, y))
    return _cosine(of_x.sum(axis=-1), of_y.sum(axis=-1), (-1,)), _cosine(of_x, of_y, (-2, -1))


def _cosine(one: Float, other: Float, axes: tuple[int, ...]) -> Float:
    scale = np.sqrt((one**2).sum(axis=axes) * (other**2).sum(axis=axes))
    return np.divide((one * other).sum(axis=axes), scale, out=np.full(scale.shape, np.nan), where=scale > 0)
