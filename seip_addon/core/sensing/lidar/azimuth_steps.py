"""Azimuth steps of channels within arcs."""

from __future__ import annotations

import math

import numpy as np

from ...base.arrays import Float, Integer


def steps_in_arcs(
    azimuth: Float, half_width: Float, size: float, steps: int, *, all_round: bool
) -> tuple[Integer, Integer, Integer]:
    """Find the rows of neighbouring azimuth steps in arcs.

    Parameters
    ----------
    azimuth : (k,) float64, radians
        Azimuth of the middle of each arc, from step 0 of its channel.
    half_width : (k,) float64, radians
        Half the width of each arc; half a turn or more is the full circle.
    size : float, radians
        Size of a step.
    steps : int
        Number of steps of a channel.
    all_round : bool
        Whether step 0 follows the last one. If not, an arc over both ends of the field of view has two rows.

    Returns
    -------
    arc : (n,) int64
        Arc of each row, ascending.
    first : (n,) int64
        First step; it may be negative or beyond the revolution if the channels go all round.
    width : (n,) int64
        Number of steps, at least 1. Rows of one arc have no step in common.
    """
    arc = np.arange(len(azimuth))
    lowest, end = -math.inf, math.inf
    if not all_round:
        full = half_width >= math.pi
        arc = np.repeat(arc, np.where(full, 1, 3))
        # steps of a limited field of view lie within a turn from step 0 on: arcs there, a turn before and one after
        azimuth, in_one = azimuth[arc] % math.tau, full[arc]
        azimuth[~in_one] += np.tile((-math.tau, 0.0, math.tau), int((~full).sum()))
        half_width = np.where(in_one, math.inf, half_width[arc])
        lowest, end = 0.0, steps
    first = np.clip(np.ceil((azimuth - half_width) / size), lowest, end).astype(np.int64)
    last = np.clip(np.floor((azimuth + half_width) / size), lowest - 1, end - 1).astype(np.int64)
    width = np.minimum(last - first + 1, steps)
    some = np.flatnonzero(width > 0)
    return arc[some], first[some], width[some]
