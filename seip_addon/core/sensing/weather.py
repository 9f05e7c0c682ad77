"""Weather: extinction of a LiDAR's light by rain and fog, and reflectivity of wet roads."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..base.counts import is_number
from ..base.errors import SeipError
from ..base.settings import setting
from ..site.scene_geometry import DEFAULT_REFLECTIVITY, Mesh, SceneGeometry
from .lidar.model import LidarModel

RAIN_EXTINCTION, RAIN_EXPONENT = 3.65e-4, 0.63
"""Extinction of rain of 1 mm/h in 1/m, and its exponent: drops of Marshall and Palmer (1948), efficiency 2."""

CONTRAST_AT_VISIBILITY = 3.0
"""Optical depth of the meteorological optical range, at which 5 % of the light is left (WMO No. 8): ln 20."""

WET_FACTOR = 0.55
"""Factor for the near infrared reflectivity (0.1 to 0.2) of a rough surface under a film of water: light that leaves
the surface is partly reflected back under the film (Lekner and Dorf 1988, refractive index 1.33)."""


@dataclass(frozen=True)
class Weather:
    """Weather in which sensors measure; clear by default.

    Parameters
    ----------
    rain : float, mm/h
        Rain rate; rain also wets the road.
    visibility : float, metres
        Meteorological optical range in fog or snow.
    wet_road : bool
        Whether roads and ground are wet without rain.

    Raises
    ------
    SeipError
        Rain is negative or too strong, or the visibility is too low.
    """

    rain: float = setting(0.0, "rain, which wets the road too", unit="mm/h", minimum=0.0, metavar="MM/H")
    visibility: float = setting(
        math.inf, "visibility in fog or snow: meteorological optical range", unit="m", minimum=1.0, metavar="M"
    )
    wet_road: bool = setting(default=False, help="roads and ground are wet")

    def __post_init__(self) -> None:
        if not 0 <= self.rain <= 500:
            raise SeipError(f"rain must lie between 0 and 500 mm/h, not {self.rain:g}")
        if not self.visibility >= 1:
            raise SeipError(f"the visibility must be 1 m or more, not {self.visibility:g} m")

    @property
    def extinction(self) -> float:
        """Extinction coefficient of the air, in 1/m, for light in one direction."""
        return float(RAIN_EXTINCTION * self.rain**RAIN_EXPONENT + CONTRAST_AT_VISIBILITY / self.visibility)

    @property
    def is_wet(self) -> bool:
        """Whether roads and ground are wet."""
        return self.wet_road or self.rain > 0

    def words(self) -> tuple[str, ...]:
        """Return the words that `weather_of` parses to this weather."""
        rain = (f"rain={self.rain!r}",) if self.rain > 0 else ()
        fog = (f"visibility={self.visibility!r}",) if math.isfinite(self.visibility) else ()
        return (*rain, *fog, *(("wet",) if self.wet_road else ()))

    def through(self, model: LidarModel) -> LidarModel:
        """Return a sensor model for this weather."""
        return model.in_air(self.extinction) if self.extinction > 0 else model

    def over(self, geometry: SceneGeometry) -> SceneGeometry:
        """Return a scene in this weather: wet roads and ground return less."""
        if not self.is_wet:
            return geometry
        return replace(geometry, roads=tuple(map(_wet, geometry.roads)), ground=tuple(map(_wet, geometry.ground)))


def weather_of(words: Sequence[str]) -> Weather:
    """Parse weather from the words of commands: ``rain=10``, ``visibility=200``, ``wet``.

    Raises
    ------
    SeipError
        A word is unknown, or its number is invalid.
    """
    given: dict[str, Any] = {}
    for word in words:
        name, _, number = word.partition("=")
        if word == "wet":
            given["wet_road"] = True
        elif name in {"rain", "visibility"} and is_number(number):
            given[name] = float(number)
        else:
            raise SeipError(f"weather {word!r} is not understood: give rain=MM/H, visibility=METRES or wet")
    return Weather(**given)


def _wet(mesh: Mesh) -> Mesh:
    dry = np.full(len(mesh.triangles), DEFAULT_REFLECTIVITY) if mesh.reflectivity is None else mesh.reflectivity
    return replace(mesh, reflectivity=dry * WET_FACTOR)
