"""Settings of visibility: conditions under which a target is seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ...base.errors import SeipError
from ...base.settings import setting
from ..lidar.model import LidarModel

Engine = Literal["auto", "bvh", "embree"]
"""Ray caster: Blender's BVH tree or Embree; ``auto`` takes Embree if it is installed."""

MAX_DELTA = 100.0
"""Metres; a larger δ is assumed to be a typing error."""


@dataclass(frozen=True)
class VisibilitySettings:
    """Conditions under which a return sees a target.

    Parameters
    ----------
    delta : float, metres
        δ: the return is nearer than this to the target.
    min_intensity : float, 0 to 1
        Least intensity of the return, for sensors of CARLA's model; 0 for no condition.
    detection : float, above 0 and below 1
        Least probability of detection of the return, for sensors of the range equation.

    Examples
    --------
    Range in metres up to which a surface of 10 % reflectivity is seen, for two probabilities of detection:

    >>> from seip_addon.core.sensing.lidar.catalogue import load_catalogue
    >>> model = load_catalogue()["os1_128"]
    >>> [round((0.1 / VisibilitySettings(detection=p).least_strength(model)) ** 0.5, 1) for p in (0.9, 0.5)]
    [40.0, 73.3]
    """

    delta: float = setting(1.0, "distance from a target within which a return sees it", unit="m", maximum=MAX_DELTA)
    min_intensity: float = 0.0
    detection: float = 0.9

    def __post_init__(self) -> None:
        if not 0 < self.delta <= MAX_DELTA:
            raise SeipError(f"delta must be a positive number of metres up to {MAX_DELTA:g}, not {self.delta}")
        if not 0 <= self.min_intensity <= 1:
            raise SeipError(f"the least intensity must lie between 0 and 1, not {self.min_intensity}")
        if not 0 < self.detection < 1:
            raise SeipError(f"the least probability of detection must lie between 0 and 1, not {self.detection}")

    def least_strength(self, model: LidarModel) -> float:
        """Return the least strength of a return that sees; 0 for no condition.

        Raises
        ------
        SeipError
            The sensor detects nothing with that probability.
        """
        try:
            return model.law.least_strength(self.detection, self.min_intensity)
        except SeipError as error:
            raise SeipError(f"{model.key}: {error}") from error
