"""Left- or right-hand traffic of an extract, from its tags, its roundabouts and its location."""

import math

import numpy as np

from .extract import Extract, Way

_LEFT_HAND = (
    ("the British Isles", 49.8, -11.0, 61.0, 1.8),
    ("Malta", 35.7, 14.1, 36.2, 14.7),
    ("Cyprus", 34.4, 32.2, 35.8, 34.7),
    ("India, Bangladesh and Sri Lanka", 5.8, 68.8, 27.5, 92.6),
    ("northern India and Pakistan", 27.5, 66.5, 35.0, 80.0),
    ("Pakistan", 24.5, 62.0, 29.8, 70.0),
    ("Nepal", 26.3, 80.0, 30.0, 88.2),
    ("Thailand", 12.5, 98.9, 18.3, 102.4),
    ("Thailand and Malaysia", 1.1, 98.2, 12.5, 104.5),
    ("Indonesia", -11.2, 95.0, 1.1, 141.1),
    ("Borneo and Sumatra", 1.1, 95.0, 7.5, 119.4),
    ("Hong Kong and Macau", 22.1, 113.5, 22.51, 114.5),
    ("Japan", 30.9, 129.0, 45.6, 146.0),
    ("Okinawa", 24.0, 122.9, 30.9, 131.4),
    ("Australia and Tasmania", -44.0, 112.8, -10.0, 154.0),
    ("New Zealand", -47.6, 166.0, -34.0, 179.0),
    ("Papua New Guinea", -11.8, 140.9, -1.0, 156.1),
    ("Fiji", -19.5, 176.8, -16.0, 182.0),
    ("southern Africa", -35.0, 11.7, -17.0, 33.0),
    ("Mozambique, Zimbabwe, Malawi and Tanzania", -27.0, 30.0, -1.0, 41.0),
    ("Zambia", -18.1, 22.0, -8.2, 33.7),
    ("Kenya", -4.8, 34.0, 4.6, 41.9),
    ("Uganda", -1.4, 29.6, 3.7, 35.0),
    ("Mauritius", -20.6, 57.2, -19.9, 57.9),
    ("Jamaica", 17.6, -78.4, 18.6, -76.1),
    ("Trinidad and Tobago", 10.0, -61.95, 11.4, -60.4),
    ("Barbados", 13.0, -59.7, 13.4, -59.4),
    ("the Bahamas", 21.9, -79.3, 27.3, -72.7),
    ("Guyana and Suriname", 1.8, -60.0, 8.3, -54.0),
)
"""Regions of left-hand traffic as south, west, north, east in degrees: coarse, for extracts without other evidence.

East is above 180 where a region reaches across the date line.
"""
_MIN_EVIDENCE = 3.0  # right angles that roundabouts turn in all, at least


def drives_on_the_left(extract: Extract) -> tuple[bool, str]:
    """Return whether traffic keeps to the left, and the reason for a message."""
    for way in extract.ways.values():
        side = way.tags.get("driving_side")
        if side in ("left", "right"):
            return side == "left", "a street has the tag driving_side"
    # Roundabouts are one-way in the order of their nodes: counter-clockwise in right-hand traffic, clockwise in
    # left-hand traffic. Angles add up over ways that are only parts of a roundabout, too.
    turn = sum(
        _turn(extract, way)
        for way in extract.ways.values()
        if way.tags.get("junction") == "roundabout" and "highway" in way.tags
    )
    if abs(turn) > _MIN_EVIDENCE * math.pi / 2:
        return turn < 0.0, "its roundabouts turn that way"
    nodes = list(extract.nodes.values())
    middle = nodes[len(nodes) // 2]
    for name, south, west, north, east in _LEFT_HAND:
        if south <= middle.latitude <= north and west <= west + (middle.longitude - west) % 360.0 <= east:
            return True, f"as in {name}"
    return False, "as in most countries"


def _turn(extract: Extract, way: Way) -> float:
    """Return the total angle that a way turns by, radians counter-clockwise."""
    steps = np.diff(extract.in_metres(extract.line(way)) @ [1.0, 1.0j])
    steps = steps[steps != 0]
    return float(np.angle(steps[1:] / steps[:-1]).sum())
