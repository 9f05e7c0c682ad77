"""Colours and marks shared by a plan and its legend."""

from typing import Any

from matplotlib.colors import LinearSegmentedColormap

from .palette import ASSUMED_POLE_COLOUR, INK, PAPER, POLE_COLOUR

Style = dict[str, Any]

HEIGHT_CMAP = LinearSegmentedColormap.from_list("heights", ("#d2d0c4", "#8b9285", "#4b5350"))
SIDEWALK_MARK: Style = {"linestyle": "none", "marker": "o", "markersize": 2.6, "mfc": PAPER, "mec": INK, "mew": 0.5}
ASSUMED_MARK: Style = {
    "linestyle": "none",
    "marker": "D",
    "markersize": 3.8,
    "mfc": PAPER,
    "mec": ASSUMED_POLE_COLOUR,
    "mew": 0.9,
}
ASSUMED_HEIGHT: Style = {"facecolor": "none", "edgecolor": "#c9cdc4", "hatch": "\\\\\\", "linewidth": 0.4}
OTHER_ROAD: Style = {"facecolor": "#d6d9d8", "edgecolor": "#b4b9ba", "linewidth": 0.4}
"""A road on another level than the studied one."""
POLE_MARK: Style = {"linestyle": "none", "marker": "D", "markersize": 3.8, "mfc": POLE_COLOUR, "mec": INK, "mew": 0.6}
