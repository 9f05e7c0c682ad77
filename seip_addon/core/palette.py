"""Colours and marks that all pictures share, told apart by colour-blind people and on grey paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .deployment import Deployment

INK = "#1d2b36"
SOFT_INK = "#5d6b76"
PAPER = "#ffffff"
SEEN_COLOURS = ("#e8823c", "#8cc4e2", "#2c72a8")
"""Of targets that no sensor, one sensor, two sensors or more see; lightness differs as well as hue."""

SEEN_WORDS = ("not seen", "seen by one sensor", "seen by two or more")
SEEN_TWICE = 2

MARKERS = ("o", "s", "^", "D", "v", "P", "h", "X")


def markers_of(deployment: Deployment) -> dict[str, str]:
    """Return a marker for each sensor type in use, by catalogue key."""
    keys = sorted({sensor.model.key for sensor in deployment.sensors})
    return {key: MARKERS[index % len(MARKERS)] for index, key in enumerate(keys)}
