"""Angles as files write them: degrees to the millionth, which hides the last bits in which platforms differ."""

import math


def degrees(heading: float) -> float:
    """Return a heading in degrees counter-clockwise, 0 <= degrees < 360."""
    return (round(math.degrees(heading), 6) + 0.0) % 360.0


def tilt_degrees(tilt: float) -> float:
    """Return a tilt in degrees, nose down positive, -90 < degrees < 90."""
    return round(math.degrees(tilt), 6) + 0.0


def clockwise_degrees(heading: float) -> float:
    """Return a heading in degrees clockwise, as left-handed axes count it, -180 <= degrees < 180."""
    return (round(-math.degrees(heading), 6) + 180.0) % 360.0 - 180.0 + 0.0
