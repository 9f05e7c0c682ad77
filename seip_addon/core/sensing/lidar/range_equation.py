r"""Detection of a LiDAR's returns by the range equation.

From a diffuse (Lambertian) surface that fills the beam, a LiDAR receives the power, up to a constant of the sensor,

.. math::

    p = \frac{ρ \cos θ \, e^{-2 α r}}{r^2}

(Jelalian 1992, *Laser Radar Systems*, section 1.2; the exponential is the Beer–Lambert law for the way out and back),
and it detects the return with the probability

.. math::

    P = c \, Φ\left(\frac{\ln p - m}{s}\right).

ρ is the reflectivity of the surface, θ the angle of incidence, α the extinction of the air, r the range and Φ the
normal distribution. c is below 1 because some returns are lost whatever their power; s is the standard deviation of ln
p about the value from reflectivity and angle. m is computed from the data sheet: from the range at which a surface of
10 % is detected.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import ClassVar

import numpy as np

from ...base.arrays import Float
from ...base.errors import SeipError
from ...base.limits import DETECTION_RANGE, DETECTION_SPREAD, DETECTION_THRESHOLD, EXTINCTION, POSITIVE_SHARE, Limits

CEILING = 0.985
SPREAD = 0.9
"""c and s of sensors without a measurement: sweeps of three makes have c of 0.98 to 1.00 and s of 0.5 to 1.3."""

MAKER_PROBABILITY = 0.9
"""Probability of detection for ranges of data sheets that state none."""

# Least ratio of the ranges at 80 and at 10 %. At this ratio the air would transmit only 1/178 of the light on the way
# to the shorter range and back. A smaller ratio implies even more extinction; data sheets are measured in clear air.
LEAST_RATIO = 1.3

_TINY = 1e-300  # keeps quotients and logarithms finite where no power is reflected
_STANDARD = NormalDist()


@dataclass(frozen=True)
class RangeEquation:
    """Probability that a LiDAR detects the return from a surface.

    Parameters
    ----------
    threshold : float
        m: ln p, in 1/m², at which half of the ceiling is reached.
    spread : float
        s, above 0.
    ceiling : float, above 0 to 1
        c.
    extinction : float, 1/m
        α, 0 or more; that of clear air, in which data sheets are measured, is nearly zero.

    Raises
    ------
    SeipError
        A parameter is out of its range.
    """

    model: ClassVar[str] = "range equation"
    threshold: float
    spread: float = SPREAD
    ceiling: float = CEILING
    extinction: float = 0.0

    def __post_init__(self) -> None:
        fault = Limits.first_fault(
            {
                "the threshold of detection": (self.threshold, DETECTION_THRESHOLD),
                "the spread of detection": (self.spread, DETECTION_SPREAD),
                "the ceiling of detection": (self.ceiling, POSITIVE_SHARE),
                "the extinction": (self.extinction, EXTINCTION),
            }
        )
        if fault:
            raise SeipError(fault)

    @classmethod
    def of_ranges(
        cls,
        at_10: float,
        at_80: float,
        probability: float = MAKER_PROBABILITY,
        spread: float = SPREAD,
        ceiling: float = CEILING,
    ) -> RangeEquation:
        """Return the law of a data sheet.

        Parameters
        ----------
        at_10, at_80 : float, metres
            Ranges at which surfaces of 10 and 80 % reflectivity that face the sensor are detected. If the longer one is
            more than √8 times the other, which no extinction explains, only the range at 10 % is used.
        probability : float
            Probability of detection at these ranges, below the ceiling.

        Raises
        ------
        SeipError
            The range at 80 % is not the longer one, or the probability is not between 0 and the ceiling.
        """
        if not (DETECTION_RANGE.allow((at_10, at_80)) and LEAST_RATIO * at_10 <= at_80):
            raise SeipError(
                f"the range at 80 % reflectivity ({at_80:g} m) must be {LEAST_RATIO:g} times the one at 10 % "
                f"({at_10:g} m) or more, and both {DETECTION_RANGE}: check which is which"
            )
        # p falls by a factor of 8 from one range to the other: what 1/r² leaves of that is extinction
        extinction = max(0.0, (math.log(8.0) - 2.0 * math.log(at_80 / at_10)) / (2.0 * (at_80 - at_10)))
        law = cls(0.0, spread, ceiling, extinction)
        at_least = math.log(0.1) - 2.0 * math.log(at_10) - 2.0 * extinction * at_10
        return replace(law, threshold=at_least - math.log(law.least_strength(probability)))

    def in_air(self, extinction: float) -> RangeEquation:
        """Return the law in air with additional extinction in 1/m, which applies on the way out and back."""
        return replace(self, extinction=self.extinction + extinction)

    def amplified(self, gain: float) -> RangeEquation:
        """Return the law of a sensor that receives ``gain`` times the power."""
        return replace(self, threshold=self.threshold - math.log(gain))

    def strength(self, distance: Float, reflected: Float) -> Float:
        """Return p in 1/m² of hits: 0 at infinite distance, infinite at distance zero.

        Parameters
        ----------
        distance : (n,) float64, metres
            Distance of each hit.
        reflected : (n,) float64
            ρ · |cos θ|.

        Returns
        -------
        (n,) float64
            Power of each return.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            power: Float = self.intensity(distance, reflected) / distance**2
        return np.where(np.isnan(power), 0.0, power)

    def intensity(self, distance: Float, reflected: Float) -> Float:
        """Return the intensity that sensors report, (n,): power without the factor 1/r², as makers calibrate it."""
        intensity: Float = reflected * np.exp(-2.0 * self.extinction * distance)
        return intensity

    def least_strength(self, probability: float, min_intensity: float = 0.0) -> float:  # noqa: ARG002  # the other law's
        """Return the least p, in 1/m², of a return that is detected with a given probability.

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

    def farthest_on_planes(self, reflectivity: Float, height: Float, least: float) -> Float:
        """Return an upper bound of the distance at which the return from each plane has a power of ``least``.

        Parameters
        ----------
        reflectivity : (n,) float64
        height : (n,) float64, metres
            Height of the sensor above each plane: cos θ is height / r there, so that p falls with r³.
        least : float, 1/m²

        Returns
        -------
        (n,) float64, metres
        """
        strength = reflectivity * height / least
        far: Float = np.cbrt(strength)
        if self.extinction == 0.0:
            return far
        # The distance is the root of f(r) = 3 ln r + 2αr − ln strength, which is increasing and concave. Hence a Newton
        # step from ∛strength, where f is 2αr, ends before the root, and the chord between these two points crosses
        # zero beyond it: a bound without iteration.
        slope = 3 / np.maximum(far, _TINY) + 2 * self.extinction
        f_far = 2 * self.extinction * far
        near = np.maximum(far - f_far / slope, _TINY)
        f_near = 3 * np.log(near) + 2 * self.extinction * near - np.log(np.maximum(strength, _TINY))
        return np.where(f_near < 0, near - f_near * (far - near) / np.maximum(f_far - f_near, _TINY), far)

    def chance(self, distance: Float, reflected: Float) -> Float:
        """Return the probability that each hit is detected, (n,) float64, 0 to `ceiling`.

        Parameters
        ----------
        distance : (n,) float64, metres
            Distance of each hit; infinite on a miss, which is never detected.
        reflected : (n,) float64
            ρ · |cos θ|.
        """
        with np.errstate(divide="ignore"):
            power = np.log(self.strength(distance, reflected))
        return self.ceiling * _normal_cdf((power - self.threshold) / self.spread)

    def reach(self, reflectivity: float, probability: float) -> float:
        """Return the range in metres up to which a surface that faces the sensor is detected with a probability."""
        return self._reach(reflectivity / self.least_strength(probability), 2)

    def reach_on_level(self, reflectivity: float, probability: float, height: float) -> float:
        """Return the range in metres up to which a level surface ``height`` metres below the sensor is detected."""
        return max(self._reach(reflectivity * height / self.least_strength(probability), 3), 0.0)

    def _reach(self, strength: float, power: int) -> float:
        """Solve strength · exp(−2αr) = rⁿ for r by bisection, with n the ``power``."""
        near, far = 0.0, float(strength ** (1.0 / power))
        if self.extinction == 0.0:
            return far
        for _ in range(200):  # until no floating-point number lies between the bounds
            middle = (near + far) / 2.0
            if not near < middle < far:
                break
            if strength * math.exp(-2.0 * self.extinction * middle) >= middle**power:
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
