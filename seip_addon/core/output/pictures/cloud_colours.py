"""Colours of the points of a cloud, on a dark ground or on a street, and what they mean."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...arrays import Float
from ...sensing.scans.frame import STATIC_INSTANCE, Frame
from .palette import INTENSITY_COLOURS, MAX_INTENSITY, SENSOR_COLOURS, STATIC_COLOUR, rgb

By = Literal["sensor", "intensity", "instance"]

GOLDEN_RATIO = 0.618033988749895  # of the colour circle, from a road user to the next: neighbours differ most


def cloud_colours(frame: Frame, by: By) -> NDArray[np.float32]:
    """Return red, green, blue and opacity (n, 4) of each point, sRGB."""
    colours = np.ones((len(frame), 4), dtype=np.float32)
    if by == "sensor":
        palette = np.array([rgb(colour) for colour in SENSOR_COLOURS])
        colours[:, :3] = palette[frame.sensor % len(palette)]
    elif by == "intensity":
        colours[:, :3] = strength_ramp(np.sqrt(np.minimum(frame.intensity / MAX_INTENSITY, 1.0)))
    else:
        hue = (frame.instance * GOLDEN_RATIO) % 1.0
        wheel = np.abs((hue[:, None] + np.array([0.0, 2.0, 1.0]) / 3.0) % 1.0 * 6.0 - 3.0) - 1.0  # of HSV, saturated
        bright = 0.35 + 0.65 * np.clip(wheel, 0.0, 1.0)
        colours[:, :3] = np.where((frame.instance == STATIC_INSTANCE)[:, None], np.array(rgb(STATIC_COLOUR)), bright)
    return colours


def strength_ramp(share: Float) -> Float:
    """Return colours (…, 3) along the scale of intensities, from 0 to 1."""
    stops = np.array([rgb(colour) for colour in INTENSITY_COLOURS])
    places = np.linspace(0.0, 1.0, len(stops))
    return np.stack([np.interp(share, places, channel) for channel in stops.T], axis=-1)


def sensor_colour(number: int) -> str:
    """Return the web colour of a sensor's points."""
    return SENSOR_COLOURS[number % len(SENSOR_COLOURS)]
