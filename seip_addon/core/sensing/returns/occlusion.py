r"""Chance that no road user hides another one from a sensor.

Let the middle of a panel (`bodies`) lie at horizontal distance d and at height m above the ground, and the sensor at
height s above the same ground. The line of sight is below the height t of a car over the horizontal distance

.. math::
    \ell = d \min\Big(1, \frac{t - m}{s - m}\Big), \quad s > m,

and over d if the sensor is not higher than the middle. If road users that hide what is behind them form a Poisson
process along the line, with μ of them per metre, none of them hides the panel with the probability

.. math::
    q = e^{-\mu \ell}.

Radio planning uses the same chance of a clear line of sight (Bai, Vaze and Heath 2014, *Analysis of Blockage Effects on
Urban Cellular Networks*). It needs no traffic of the site, and it is what a high mount gains: a car at 40 m is hidden
with 54 % from a height of 4.6 m, and with 34 % from 8 m.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Float
from .bodies import PANELS
from .road_users import BODIES, RoadUsers

HIDING = 0.1
"""Road users per metre of a line of sight below a car's height that hide what is behind them, μ.

Chosen by average precision on the open benchmark (docs/open-benchmark.md): from 0.06 to 0.2, rank correlations of the
criterion with it change by at most 0.02. Vehicles are less dense: a panel that is hidden in part counts as hidden here.
"""


def clear_chance(origin: Float, users: RoadUsers) -> Float:
    """Return the chance that no other road user hides each road user from a sensor, (m,) float64.

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
