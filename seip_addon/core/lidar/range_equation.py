r"""Detection of a LiDAR's returns by the range equation.

Of a diffuse (Lambertian) surface that fills the beam a LiDAR receives, but for a constant of the sensor, the power

.. math::

    p = \frac{ρ \cos θ \, e^{-2 α r}}{r^2}

(Jelalian 1992, *Laser Radar Systems*, section 1.2), and it detects the return with the probability

.. math::

    P = c \, Φ\left(\frac{\ln p - m}{s}\right).

ρ is the reflectivity of the surface, θ the angle of incidence, α the extinction of the air, r the range and Φ the
normal distribution. c is below 1 because some returns are lost whatever their power; s is the spread of ln p about
what reflectivity and angle tell of it, most of which is the surface's own. m follows from the data sheet: from the
range at which a surface of 10 % is detected.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from statistics import NormalDist

import numpy as np

from ..arrays import Float
from ..errors import SeipError

CEILING = 0.985
SPREAD = 0.9
"""c and s where nothing is known of the sensor: sweeps of three makes have c of 0.98 to 1.00 and s of 0.5 to 1.3."""

_STANDARD = NormalDist()


@dataclass(frozen=True)
class DetectionLaw:
    """How likely a LiDAR detects the return of a surface.

    Parameters
    ----------
    threshold : float
        m: ln p, in 1/m², at which half of the ceiling is reached.
    spread : float
        s, above 0.
    ceiling : float, above 0 to 1
        c.
    extinction : float, 1/m
        α, 0 or more: of clear air, where data sheets were measured, next to nothing.
    """

    threshold: float
    spread: float = SPREAD
    ceiling: float = CEILING
    extinction: float = 0.0

    @classmethod
    def of_ranges(
        cls, at_10: float, at_80: float, probability: float = 0.9, *, spread: float = SPREAD, ceiling: float = CEILING
    ) -> DetectionLaw:
        """Return the law of a data sheet.

        Parameters
        ----------
        at_10, at_80 : float, metres
            Ranges at which surfaces of 10 and 80 % reflectivity that face the sensor are detected.
        probability : float
            With which they are, below the ceiling.

        Raises
        ------
        SeipError
            The range at 80 % is not the longer one, or the probability is not between 0 and the ceiling.
        """
        if not 0 < at_10 < at_80 < math.inf:
            raise SeipError(
                f"the range at 80 % reflectivity ({at_80:g} m) must be above the one at 10 % ({at_10:g} m), and that "
                "above 0 m"
            )
        # p falls by a factor of 8 from one range to the other: what 1/r² leaves of that is extinction
        extinction = max(0.0, (math.log(8.0) - 2.0 * math.log(at_80 / at_10)) / (2.0 * (at_80 - at_10)))
        law = cls(0.0, spread, ceiling, extinction)
        least = math.log(0.1) - 2.0 * math.log(at_10) - 2.0 * extinction * at_10
        return replace(law, threshold=least - math.log(law.least_power(probability)))

    def probability(self, distance: Float, cos_incidence: Float, reflectivity: Float | float) -> Float:
        """Return the probability of detection.

        Parameters
        ----------
        distance : (n,) float64, metres
            Infinite on a miss, which is never detected.
        cos_incidence : (n,) float64
            Cosine of the angle between ray and surface normal, of either sign.
        reflectivity : (n,) float64 or float, 0 to 1

        Returns
        -------
        (n,) float64, 0 to `ceiling`
        """
        with np.errstate(divide="ignore"):
            power = np.log(self.power(distance, cos_incidence, reflectivity))
        return self.ceiling * _normal_cdf((power - self.threshold) / self.spread)

    def power(self, distance: Float, cos_incidence: Float, reflectivity: Float | float) -> Float:
        """Return p in 1/m², (n,) float64, for arguments as of `probability`: 0 on a miss, infinite at no distance."""
        hit = np.isfinite(distance)
        there = np.where(hit, distance, 1.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            received = np.abs(cos_incidence) * reflectivity * np.exp(-2.0 * self.extinction * there) / there**2
        power: Float = np.where(hit, np.nan_to_num(received, nan=0.0, posinf=np.inf), 0.0)
        return power

    def least_power(self, probability: float) -> float:
        """Return p in 1/m² from which on a return is detected with a probability or more.

        Raises
        ------
        SeipError
            The probability is not between 0 and the ceiling.
        """
        if not 0 < probability < self.ceiling:
            raise SeipError(
                f"a probability of detection must lie above 0 and below {self.ceiling:g}, which is the most that the "
                f"sensor reaches, not {probability:g}"
            )
        return math.exp(self.threshold + self.spread * _STANDARD.inv_cdf(probability / self.ceiling))

    def reach(self, reflectivity: float, probability: float, cos_incidence: float = 1.0) -> float:
        """Return the range in metres up to which a surface is detected with a probability or more."""
        squared = abs(cos_incidence) * reflectivity / self.least_power(probability)
        far = math.sqrt(squared)
        if self.extinction == 0.0 or far == 0.0:
            return far
        near = 0.0
        for _ in range(200):  # halves the doubt until no number lies between
            middle = (near + far) / 2.0
            if not near < middle < far:
                break
            if squared * math.exp(-2.0 * self.extinction * middle) >= middle**2:
                near = middle
            else:
                far = middle
        return near


def _normal_cdf(z: Float) -> Float:
    """Return Φ(z) to 1.5e-7 (Abramowitz and Stegun 1964, formula 7.1.26)."""
    x = np.abs(z) / math.sqrt(2.0)
    t = 1.0 / (1.0 + 0.3275911 * x)
    series = t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))))
    tail: Float = 0.5 * series * np.exp(-(x**2))
    return np.where(z < 0.0, tail, 1.0 - tail)
