r"""The pattern of a beam through two rotating wedge prisms, which hardly ever repeats: a rosette.

The beam comes along the axis. It enters the first prism through its flat face, which is perpendicular to the axis, and
leaves it through its oblique face; it enters the second prism through its oblique face and leaves it through its flat
one. Of the four ways to mount the Mid-40's prisms [1]_ this one gives its field of view. Each ray is traced from face
to face [2]_. The normals of the oblique faces, along the beam, differ from the axis by the wedge angles, in opposite
directions when the prisms deflect the same way. At each face, light of direction d is refracted by Snell's law, with
the normal n along it and the ratio μ of the refractive indices before and behind the face:

.. math::

    d' = μ d + \left(\sqrt{1 - μ^2 (1 - c^2)} - μ c\right) n, \quad c = d · n

Thin prisms deflect by (index − 1) times their wedge angle each, and the two deflections add up as rotating vectors.

.. [1] Liu, Zhang and Hong 2022, "Low-cost retina-like robotic lidars based on incommensurable scanning", IEEE/ASME
   Transactions on Mechatronics 27(1), arXiv:2006.11034.
.. [2] Li, Liu and Sun 2017, "Forward and inverse solutions for three-element Risley prism beam scanners", Optics
   Express 25(7), 7677.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ...base.arrays import Float
from ...base.errors import SeipError
from ...base.limits import PRISM_RATE, PRISM_WEDGE, REFRACTIVE_INDEX, TIME, Limits


@dataclass(frozen=True)
class Rosette:
    """Two rotating wedge prisms.

    Parameters
    ----------
    rates : tuple of two floats, hertz
        Rates of the prisms in the order in which the beam meets them. Positive ones rotate counter-clockwise, from +y
        to +z, as seen against the beam.
    wedges : tuple of two floats, radians
        Angles between the faces of each prism.
    index : float
        Refractive index of both prisms.
    begin : float, seconds
        Time of the first ray; at time 0 both prisms deflect towards +y.

    Raises
    ------
    SeipError
        A figure is out of range, the prisms draw no rosette, or they let no light through.
    """

    rates: tuple[float, float]
    wedges: tuple[float, float]
    index: float
    begin: float = 0.0

    def __post_init__(self) -> None:
        one, other = self.rates
        fault = Limits.first_fault(
            {
                "the rate of a prism": (np.abs(self.rates), PRISM_RATE),
                "the wedge angle of a prism": (np.degrees(self.wedges), PRISM_WEDGE),
                "the refractive index": (self.index, REFRACTIVE_INDEX),
                "the time at which the rosette begins": (self.begin, TIME),
            }
        )
        if fault:
            raise SeipError(fault)
        checks = {
            "prisms that turn at the same rate draw a circle: their rates must differ": one != other,
            "prisms that turn at opposite rates draw a line: their rates must differ": one != -other,
        }
        for sentence, holds in checks.items():
            if not holds:
                raise SeipError(sentence)
        if not self._through(np.zeros(1), np.zeros(1))[0, 0] > 0:
            raise SeipError("prisms of this index and these wedge angles let no light through: take smaller angles")

    @property
    def reach(self) -> float:
        """Largest angle between the beam and the axis, radians: when both prisms deflect the same way."""
        along, left, _ = self._through(np.zeros(1), np.zeros(1))[0]
        return math.atan2(left, along)

    def later(self, seconds: float) -> Rosette:
        """Return the rosette that begins ``seconds`` later."""
        return replace(self, begin=self.begin + seconds)

    def directions(self, delay: Float) -> Float:
        """Return unit directions (n, 3), x along the axis, of rays emitted at delays (n,), in seconds."""
        time = self.begin + delay
        one, other = (math.tau * (rate * time % 1.0) for rate in self.rates)
        return self._through(one, other)

    def _through(self, one: Float, other: Float) -> Float:
        """Return directions (n, 3) behind prisms rotated by angles (n,); NaN where no light passes."""
        level = np.zeros_like(one)
        flat = np.stack([level + 1.0, level, level], axis=-1)
        first, second = _tilted(one, -self.wedges[0]), _tilted(other, self.wedges[1])
        return refracted(refracted(refracted(flat, first, self.index), second, 1 / self.index), flat, self.index)


def refracted(directions: Float, normals: Float, ratio: float) -> Float:
    """Return the directions (n, 3) of light behind faces, by Snell's law.

    Parameters
    ----------
    directions, normals : (n, 3) float64
        Unit vectors, the normals along the light.
    ratio : float
        Ratio of the refractive index before the faces to that behind them.

    Returns
    -------
    (n, 3) float64
        Unit vectors; NaN where a face reflects all light.
    """
    cosine = (directions * normals).sum(axis=-1, keepdims=True)
    with np.errstate(invalid="ignore"):
        along = np.sqrt(1.0 - ratio**2 * (1.0 - cosine**2)) - ratio * cosine
    bent: Float = ratio * directions + along * normals
    return bent


def _tilted(angle: Float, wedge: float) -> Float:
    """Return normals (n, 3) of oblique faces rotated by angles (n,)."""
    along, aside = np.full_like(angle, math.cos(wedge)), math.sin(wedge)
    return np.stack([along, aside * np.cos(angle), aside * np.sin(angle)], axis=-1)
