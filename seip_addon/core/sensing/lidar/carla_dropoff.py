"""Detection of a LiDAR's returns as in CARLA's ray-cast LiDAR, which uses the intensity only."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ...base.arrays import Float
from ...base.errors import SeipError
from ...base.limits import ATTENUATION, POSITIVE_SHARE, SHARE, Limits


@dataclass(frozen=True)
class CarlaDropoff:
    """The drop-off model of CARLA 0.9's ray-cast LiDAR, with a surface's reflectivity and angle in the intensity.

    A return of at least ``intensity_limit`` is kept. Below it, the probability of loss grows linearly to
    ``zero_intensity`` at intensity 0. In addition, a share ``general`` of all returns is lost.

    Parameters
    ----------
    attenuation : float, 1/m
        a in the intensity I = ρ · |cos θ| · exp(−a · r).
    general, intensity_limit, zero_intensity : float, 0 to 1
        General loss, least intensity without loss by intensity, and loss at intensity 0.

    Raises
    ------
    SeipError
        A parameter is out of its range.
    """

    model: ClassVar[str] = "carla"
    attenuation: float = 0.004
    general: float = 0.0
    intensity_limit: float = 0.8
    zero_intensity: float = 0.4

    def __post_init__(self) -> None:
        fault = Limits.first_fault(
            {
                "the attenuation": (self.attenuation, ATTENUATION),
                "the general drop-off": (self.general, SHARE),
                "the drop-off at zero intensity": (self.zero_intensity, SHARE),
                "the drop-off's intensity limit": (self.intensity_limit, POSITIVE_SHARE),
            }
        )
        if fault:
            raise SeipError(fault)

    def in_air(self, extinction: float) -> CarlaDropoff:
        """Return the law in air with additional extinction, in 1/m, on the way out and back."""
        return replace(self, attenuation=self.attenuation + 2.0 * extinction)

    def strength(self, distance: Float, reflected: Float) -> Float:
        """Return I, (n,) float64, of hits; see `RangeEquation.strength`."""
        intensity: Float = reflected * np.exp(-self.attenuation * distance)
        return intensity

    intensity = strength
    """Intensity that the sensor reports: the same quantity by which returns are lost."""

    def least_strength(self, probability: float, min_intensity: float) -> float:  # noqa: ARG002  # of the other law
        """Return the least I of a return that counts: the given one, as this law has no probability of detection."""
        return min_intensity

    def farthest_on_planes(self, reflectivity: Float, height: Float, least: float) -> Float:
        """Return the distance (n,) in metres beyond which no plane at distance ``height`` has an I of ``least``."""
        far: Float = reflectivity * height / least
        return far

    def reach(self, reflectivity: float, probability: float) -> float:  # noqa: ARG002  # of the other law
        """Return the range in metres up to which returns count: infinite."""
        return math.inf

    def chance(self, distance: Float, reflected: Float, deviation: Float | float | None = None) -> Float:  # noqa: ARG002
        """Return the probability that each return is not lost, (n,) float64; surfaces do not deviate in CARLA."""
        slope = self.zero_intensity / self.intensity_limit
        keep = np.minimum(1.0, slope * self.intensity(distance, reflected) + (1.0 - self.zero_intensity))
        chance: Float = (1.0 - self.general) * keep
        return chance
