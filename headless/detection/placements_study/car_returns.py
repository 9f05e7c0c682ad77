"""Returns that a sensor would have from a car at each target, counted from its rays through the empty scene."""

import math

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.lidar import beam_directions, return_chance
from seip_addon.core.scans import MountedSensor
from seip_addon.core.visibility.ray_casting import RayCaster

CAR_LENGTH, CAR_WIDTH, CAR_HEIGHT = 4.5, 1.8, 1.5  # metres
CAR_SPAN = 2 * (CAR_LENGTH + CAR_WIDTH) / math.pi
"""Width in metres of a car seen from the side, the mean over all headings: perimeter of its plan over π (Cauchy)."""

CAR_REFLECTED = 0.5 * 2 / math.pi  # reflectivity of paint times the mean cosine of the angle on a vertical surface
MIN_LEVEL = 1e-6  # share of a ray that runs level, below which it is vertical and meets no upright car
TOLERANCE = 0.1  # metres by which a surface may stand before the car: the road beneath it


def returns_on_cars(sensor: MountedSensor, caster: RayCaster, targets: Float) -> Float:
    """Return the expected number of returns from a car at each target, (t,).

    The car is an upright rectangle over the target that faces the sensor, `CAR_SPAN` wide and `CAR_HEIGHT` high. A ray
    counts with its chance to return, where nothing of the empty scene stands before the car.

    Parameters
    ----------
    caster : RayCaster
        Of the empty scene.
    targets : (t, 3) float64, metres
    """
    beams = beam_directions(sensor.model).reshape(-1, 3) @ sensor.orientation.T
    level = np.hypot(beams[:, 0], beams[:, 1])
    beams, level = beams[level > MIN_LEVEL], level[level > MIN_LEVEL]
    free = caster.cast(sensor.xyz, beams, sensor.model.max_range)[0] * level
    order = np.argsort(azimuth := np.arctan2(beams[:, 1], beams[:, 0]), kind="stable")
    turns = np.repeat((-math.tau, 0.0, math.tau), len(order))  # the circle thrice: no window crosses its end
    order = np.tile(order, 3)
    azimuth = azimuth[order] + turns
    slope, level, free = beams[order, 2] / level[order], level[order], free[order]

    offset = targets - sensor.xyz
    distance, towards = np.hypot(offset[:, 0], offset[:, 1]), np.arctan2(offset[:, 1], offset[:, 0])
    half = np.arctan2(CAR_SPAN / 2, distance)
    first, last = np.searchsorted(azimuth, towards - half), np.searchsorted(azimuth, towards + half, side="right")
    returns = np.zeros(len(targets))
    for target in range(len(targets)):
        rays = slice(first[target], last[target])
        along = distance[target] / np.cos(azimuth[rays] - towards[target])
        height = slope[rays] * along - offset[target, 2]
        meets = (height >= 0) & (height <= CAR_HEIGHT) & (free[rays] >= along - TOLERANCE)
        reach = along[meets] / level[rays][meets]
        returns[target] = return_chance(sensor.model, reach, np.full(len(reach), CAR_REFLECTED)).sum()
    return returns
