"""Windows of channels and azimuths in which an object can be hit."""

from __future__ import annotations

import math

import numpy as np

from ...base.arrays import Float, Integer, concatenated_ranges
from ..lidar.beam_windows import channels_between, steps_in_arcs
from ..lidar.model import LidarModel


def rays_towards(model: LidarModel, points: Float) -> tuple[Integer, Integer]:
    """Find all rays that pass through convex hulls of points, and few that do not.

    Parameters
    ----------
    points : (k, m, 3) float64, metres
        m points of each of k hulls, in the sensor's axes.

    Returns
    -------
    hull : (p,) int64
        Hull of each pair, ascending.
    ray : (p,) int64
        Ray of each pair: ``channel * azimuth_count + step``, as in `BeamPattern`.
    """
    # A hull lies in an arc of azimuths and in a range of slopes. Every channel within these slopes is paired with the
    # hull, and of its azimuth steps those within the arc are taken. Channels differ in the azimuth of step 0.
    middle, half, near = _azimuths(points)
    far = np.hypot(points[:, :, 0], points[:, :, 1]).max(axis=1)
    hull, channel = channels_between(model, points[:, :, 2].min(axis=1), points[:, :, 2].max(axis=1), near, far)
    zero = (model.azimuth_offsets + model.first_azimuth)[channel]
    arc, first, count = steps_in_arcs(
        middle[hull] - zero, half[hull], model.azimuth_step, model.azimuth_count, all_round=model.all_round
    )
    # An arc may run over step 0 of an all-round channel: its steps wrap. The rows of a hull in a channel have no step
    # in common, so that no ray comes twice for a hull.
    steps = concatenated_ranges(first, count) % model.azimuth_count
    return np.repeat(hull[arc], count), np.repeat(channel[arc] * model.azimuth_count, count) + steps


def _azimuths(points: Float) -> tuple[Float, Float, Float]:
    """Return middle and half width of each hull's arc, and a lower bound on its distance in plan, (k,) each.

    Seen from outside, a hull's arc is that of its points and less than half a turn. Seen from inside, its points lie on
    all sides, at least half a turn apart.
    """
    # Azimuths are measured from that of the points' mean, so that the arc does not cross ±π when seen from outside.
    x, y = points[:, :, 0], points[:, :, 1]
    centre = np.arctan2(y.mean(axis=1), x.mean(axis=1))
    turn = (np.arctan2(y, x) - centre[:, None] + math.pi) % (2 * math.pi) - math.pi
    low, high = turn.min(axis=1), turn.max(axis=1)
    middle, half = centre + (low + high) / 2, (high - low) / 2
    # every point is at least this far along the middle of the arc, and so is the hull; from inside the distance is zero
    along = x * np.cos(middle)[:, None] + y * np.sin(middle)[:, None]
    # an arc of half a turn or more means that the sensor is inside the hull, which then lies in all directions
    within = half >= math.pi / 2
    return middle, np.where(within, math.pi, half), np.where(within, 0.0, np.maximum(along.min(axis=1), 0.0))
