"""Physical limits of numbers in files and options: each is finite and within the limits of its kind.

All readers and options take their limits from here. Limits are wide enough for every real site, and narrow enough that
results computed from numbers within them neither overflow nor lose the millimetre.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import Boolean
from .errors import SeipError

_MAX_QUOTED = 40  # characters of a value in a message at most
_OPEN = 1e15  # limits from here on are not named in messages


@dataclass(frozen=True)
class Limits:
    """Allowed range of a quantity, both ends included; NaN and infinity are never allowed.

    Parameters
    ----------
    least, most : float
    unit : str
        Unit for messages, or "" for none.

    Examples
    --------
    >>> height = Limits(0.01, 1_000.0, "m")
    >>> height.allow([3.5, 8.0])
    True
    >>> height.require([3.5, -2.0], "site.toml", "height")
    Traceback (most recent call last):
    ...
    seip_addon.core.base.errors.SeipError: site.toml: height is -2, not 0.01 to 1,000 m; correct it
    """

    least: float
    most: float
    unit: str = ""

    def each(self, values: NDArray[Any]) -> Boolean:
        """Return which values of an array of numbers lie within the limits, bool of the same shape."""
        within: Boolean = (values >= self.least) & (values <= self.most)
        return within

    def allow(self, values: ArrayLike) -> bool:
        """Return whether all values are numbers within the limits."""
        array = np.asarray(values)
        return array.dtype.kind in "fiu" and bool(self.each(array).all())

    def fault(self, values: ArrayLike) -> str:
        """Return the fault of a value, or of the first invalid one of several, as part of a sentence.

        Returns
        -------
        str
            Text such as ``is nan, not 0 to 1,000 m``; "" if all values are allowed.
        """
        if self.allow(values):
            return ""
        wrong: Any = values
        array = np.asarray(values)
        if array.dtype.kind in "fiu":
            wrong = array[~self.each(array)].flat[0].item()  # NumPy 2 shows its own scalars with their type
        shown = f"{wrong:g}" if isinstance(wrong, float) else repr(wrong)[:_MAX_QUOTED]
        return f"is {shown}, not {self.broken_by(wrong)}"

    def broken_by(self, value: object) -> str:
        """Return the limits as text for a value outside them: the upper one if that is not named otherwise."""
        if self.least > -_OPEN and self.most >= _OPEN and isinstance(value, int | float) and value > self.most:
            return f"at most {self.most:g}"
        return str(self)

    def require(self, values: ArrayLike, file: object, field: str, cure: str = "correct it") -> None:
        """Check the values of a field of a file.

        Raises
        ------
        SeipError
            A value is not a finite number within the limits; the message names file, field, value and limits.
        """
        if fault := self.fault(values):
            raise SeipError(f"{file}: {field} {fault}; {cure}")

    @staticmethod
    def first_fault(checks: Mapping[str, tuple[ArrayLike, Limits]]) -> str:
        """Return the first fault of several quantities as a sentence without a full stop, or "".

        Parameters
        ----------
        checks : mapping of str to (value or values, Limits)
            Values and limits by the name of each quantity in words.
        """
        faults = ((name, limits.fault(values)) for name, (values, limits) in checks.items())
        return next((f"{name} {fault}" for name, fault in faults if fault), "")

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        if self.least <= -_OPEN and self.most >= _OPEN:
            return f"a finite number{unit and ' of'}{unit}"
        if self.least <= -_OPEN:
            return f"at most {_shown(self.most)}{unit}"
        if self.most >= _OPEN:
            return f"at least {_shown(self.least)}{unit}"
        return f"{_shown(self.least)} to {_shown(self.most)}{unit}"


def _shown(value: float) -> str:
    return f"{value:,.10g}" if 1e-3 <= abs(value) < 1e9 or not value else f"{value:g}"


MAP_COORDINATE = Limits(-1e8, 1e8, "m")
"""Coordinate of a map: more than the circumference of the Earth, which no projection exceeds."""

LOCAL_COORDINATE = Limits(-1e7, 1e7, "m")
"""Coordinate from the local origin of a site."""

GROUND = Limits(-500.0, 9_000.0, "m")
"""Elevation of the ground above sea level."""

ELEVATION = Limits(-10_000.0, 10_000.0, "m")
"""Height of the ground, and of objects on it, above the zero of a map or model."""

HEIGHT = Limits(0.01, 1_000.0, "m")
"""Height of an object from its foot to its top: no building is higher."""

ABOVE_GROUND = Limits(-1_000.0, 1_000.0, "m")
"""Height of a point of an object, or of a sensor, above the ground."""

SIZE = Limits(0.001, 100_000.0, "m")
"""Length, width, thickness or spacing."""

DISTANCE = Limits(0.0, 100_000.0, "m")
"""Distance, which may be zero."""

SITE_RADIUS = Limits(0.1, 5_000.0, "m")
"""Distance from the middle of a place to the end of its region of interest."""

ROAD_LENGTH = Limits(0.0, 1e6, "m")
"""Length of a road, lane or street."""

MAP_NUMBER = Limits(-1e9, 1e9)
"""Any number of a road map, coefficients of polynomials among them."""

ROAD_USER_SIZE = Limits(0.01, 100.0, "m")
"""Length, width or height of a road user."""

PRICE = Limits(0.0, 1e9, "USD")
WEIGHT = Limits(0.0, 1e6)
"""Weight of a target or region: with a million targets sums stay exact to a billionth."""

CHOSEN_WEIGHT = Limits(1e-6, 1e6)
"""Weight that a user gives to a region: above zero."""

SHARE = Limits(0.0, 1.0)
COUNT = Limits(0, 1e12)
DEGREES = Limits(-360.0, 360.0, "degrees")
LATITUDE = Limits(-90.0, 90.0, "degrees")
LONGITUDE = Limits(-180.0, 180.0, "degrees")
UNWRAPPED_ANGLE = Limits(-1e5, 1e5, "rad")
"""Heading with whole turns."""

TIME = Limits(-1e11, 1e11, "s")

TIME_STEP = Limits(0.001, 86400.0, "s")
"""Time from frame to frame."""

SPEED = Limits(-1e3, 1e3, "m/s")
FRAMES = Limits(1, 1_000_000)
"""Frames of a recording or of the test of a detector."""

SCENARIOS = Limits(1, 10_000)
"""Scenarios, or instants of traffic, to optimise on: the visibility of all candidates in each is kept."""

DRAWS = Limits(1, 100_000)
"""Random draws to evaluate a placement on."""

SENSORS = Limits(1, 100_000)
SEED = Limits(0, 2**63 - 1)

LIDAR_RANGE = Limits(0.0, 10_000.0, "m")
"""Distance of a return from its sensor."""

SENSOR_COORDINATE = Limits(-10_000.0, 10_000.0, "m")
"""Coordinate in the axes of a sensor."""

SWEEP_POINTS = Limits(0, 20_000_000)
"""Points of a sensor in one revolution."""

DETECTION_RANGE = Limits(0.1, 10_000.0, "m")
"""Range at which a data sheet says that a surface is detected."""

POINT_RATE = Limits(1.0, 1e9)
"""Points per second of a sensor."""

ROTATION_RATE = Limits(0.01, 1_000.0, "Hz")
CHANNELS = Limits(2, 10_000)
"""Channels at even elevations."""

BEAM_ELEVATION = Limits(-89.999, 89.999, "degrees")
"""Elevation of a beam, short of straight up and down, where it has no azimuth."""

BEAM_OFFSET = Limits(-720.0, 720.0, "degrees")
"""Azimuth of a channel ahead of the sensor's head: two turns at most."""

HORIZONTAL_VIEW = Limits(0.001, 360.0, "degrees")
GAIN = Limits(1e-3, 1e3)
"""Power received, as a multiple of what the law of detection says."""

RANGE_NOISE = Limits(0.0, 10.0, "m")
NOISE_GROWTH = Limits(0.0, 0.01, "per metre")
"""Growth of the range noise for each square metre of the squared range."""

DETECTION_THRESHOLD = Limits(-60.0, 20.0, "(ln of 1/m²)")
DETECTION_SPREAD = Limits(0.05, 10.0)
POSITIVE_SHARE = Limits(1e-15, 1.0)
"""Share that is above zero."""

EXTINCTION = Limits(0.0, 10.0, "per metre")
"""Share of the light that the air takes."""

ATTENUATION = Limits(0.0, 1e9, "per metre")
"""Decay of CARLA's intensity: as steep as it takes to stand for any law of detection."""
