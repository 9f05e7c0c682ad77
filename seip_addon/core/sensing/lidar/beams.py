"""The directions of a LiDAR's rays."""

from __future__ import annotations

import functools

import numpy as np

from ...base.arrays import Float, Integer
from .model import LidarModel


class BeamPattern:
    """Directions of a model's rays, with the same bits in every batch of rays.

    Ray (channel c, step k) has the azimuth yaw + offset[c] + first_azimuth + k azimuth_step, counter-clockwise from +x,
    and the elevation elevation[c]. Sines and cosines come from tables and the addition theorem: products and sums of
    float64 have the same bits in every batch, which vectorised sines need not have.

    Parameters
    ----------
    yaw : float, radians
        Direction of azimuth zero.
    """

    def __init__(self, model: LidarModel, yaw: float = 0.0) -> None:
        self.shape = (model.channels, model.azimuth_count)
        self._step_cos, self._step_sin = _turns(model.azimuth_count, model.azimuth_step, model.first_azimuth)
        turn = yaw + model.azimuth_offsets
        level = np.cos(model.elevations)
        self._turn_cos, self._turn_sin = np.cos(turn) * level, np.sin(turn) * level
        self._rise = np.sin(model.elevations)

    def directions(self, rays: Integer) -> Float:
        """Return unit directions of rays given by ``channel * azimuth_count + step``.

        Parameters
        ----------
        rays : (n,) int64
            Numbers of the rays.

        Returns
        -------
        (n, 3) float64
            Unit vectors.
        """
        channel, step = np.divmod(rays, self.shape[1])
        cos, sin = self._step_cos[step], self._step_sin[step]
        turn_cos, turn_sin = self._turn_cos[channel], self._turn_sin[channel]
        out = np.empty((len(rays), 3))
        out[:, 0] = cos * turn_cos - sin * turn_sin
        out[:, 1] = sin * turn_cos + cos * turn_sin
        out[:, 2] = self._rise[channel]
        return out


@functools.cache
def _turns(steps: int, step: float, first: float) -> tuple[Float, Float]:
    """Return cosines and sines of ``steps`` azimuths at equal distances, in radians, from a first one on."""
    angle = first + step * np.arange(steps)
    return np.cos(angle), np.sin(angle)
