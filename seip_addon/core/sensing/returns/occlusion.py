r"""Chance that no road user hides another one from a sensor, and the returns that are left with it.

Let the middle of a panel (`bodies`) lie at horizontal distance d and at height m above the ground, and the sensor at
height s above the same ground. The line of sight is below the height t of a car over the horizontal distance

.. math::
    \ell = d \min\Big(1, \frac{t - m}{s - m}\Big), \quad s > m,

and over d if the sensor is not higher than the middle. If road users that hide what is behind them form a Poisson
process along the line, with μ of them per metre, none of them hides the panel with the probability

.. math::
    q = e^{-\mu \ell},

and of the expected returns R (`expected_returns`) q R are left. Radio planning uses the same probability of a clear
line of sight (Bai, Vaze and Heath 2014, *Analysis of Blockage Effects on Urban Cellular Networks*). It needs no traffic
of the site, and it rewards high mounts: a car at 40 m is hidden with a probability of 54 % from a height of 4.6 m, and
of 34 % from 8 m.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...base.arrays import Float
from .bodies import PANELS
from .road_users import BODIES, RoadUsers

HIDING = 0.1
"""Road users per metre of a line of sight below a car's height that hide what is behind them, μ.

Chosen by average precision on the open benchmark (docs/open-benchmark.md): from 0.06 to 0.2, rank correlations of the
criterion with it change by at most 0.02, though single placements differ. Vehicles are less dense in most traffic: the
number is an allowance, in which a panel that is hidden in part counts as hidden.
"""


def clear_chance(origin: Float, users: RoadUsers) -> Float:
    """Return the probability that no other road user hides each road user from a sensor, (m,) float64.

    Parameters
    ----------
    origin : (3,) float64, metres
        Position of the sensor, local site axes.
    """
    middle = np.array([PANELS[name].height / 2 for name in BODIES])[users.body]
    x, y, z = (users.xyz - origin).T
    above = -z - middle  # of the sensor over the middle of each panel
    low = PANELS["car"].height - middle
    below = np.where(above > low, low / np.where(above > low, above, 1.0), 1.0)
    chance: Float = np.exp(-HIDING * np.hypot(x, y) * below)
    return chance


def returns_in_traffic(returns: NDArray[np.float32], origins: Float, users: RoadUsers) -> NDArray[np.float32]:
    """Return the expected returns with the chance that traffic hides road users, (c, m) float32.

    Parameters
    ----------
    returns : (c, m) float32
        Expected returns of poses from road users that nothing but static objects hides.
    origins : (c, 3) float64, metres
        Positions of the poses, local site axes.
    """
    left = np.empty_like(returns)
    for row, clear, origin in zip(left, returns, origins, strict=True):
        row[:] = clear * clear_chance(origin, users)
    return left
