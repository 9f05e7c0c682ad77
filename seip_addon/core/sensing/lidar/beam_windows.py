"""Windows of beams: the channels within heights, and their azimuth steps within arcs."""

from __future__ import annotations

import math

import numpy as np

from ...base.arrays import Float, Integer, concatenated_ranges
from .model import LidarModel


def channels_between(model: LidarModel, bottom: Float, top: Float, near: Float, far: Float) -> tuple[Integer, Integer]:
    """Find the channels that are between two heights somewhere over some distances.

    Parameters
    ----------
    bottom, top : (k,) float64, metres
        Heights above the sensor.
    near, far : (k,) float64, metres
        Smallest and largest distance in plan; nothing is found beyond the range of the model.

    Returns
    -------
    item, channel : (n,) int64
        Pairs of an item, ascending, and a channel.
    """
    # The slope to an edge of a given height is most extreme at the near or at the far side, by the sign of the height.
    # In order of slope, the channels between the two are one slice, found by bisection.
    with np.errstate(divide="ignore"):  # at distance zero everything is straight above or below
        least = bottom / np.where(bottom < 0, near, far)
        most = top / np.where(top > 0, near, far)
    order = np.argsort(model.elevations, kind="stable")
    slopes = np.tan(model.elevations[order])
    low = np.searchsorted(slopes, least)
    count = np.maximum(np.searchsorted(slopes, most, side="right") - low, 0)
    count[near > model.max_range] = 0
    return np.repeat(np.arange(len(count)), count), order[concatenated_ranges(low, count)]


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
