"""All colours that mean something, in pictures, in the viewport and in files: coverage, sensors and areas share no hue.

Coverage is orange and blue, which colour-blind people tell apart, sensors are yellow, green and pink, and areas are red
and violet. Within a group colours differ in lightness as well, so that they remain distinct in greyscale.

`tests/core/output/pictures/test_palette.py` shows its use.
"""

INK = "#1d2b36"
SOFT_INK = "#5d6b76"
PAPER = "#ffffff"

SEEN_TWICE = 2
SEEN_COLOURS = ("#e8823c", "#8cc4e2", "#2c72a8")
"""Targets that no sensor, one sensor, two sensors or more see; lightness differs as well as hue."""
SEEN_WORDS = ("not seen", "seen by one sensor", "seen by two or more")
RETURNS_COLOURS = (SEEN_COLOURS[0], "#f6c9a8", *SEEN_COLOURS[1:])
"""Places by the returns that a pedestrian has there, from fewest to most; the first two are too few to be found."""
COMPARED_COLOURS = ("#8a8f94", "#cfd6db", SEEN_COLOURS[2], SEEN_COLOURS[0])
"""Targets seen by neither of two placements, by both, only by the present and only by the kept one."""
DENSE_BEAMS, WIDE_BEAMS = "#4dbfff", "#ff8c1a"
"""Beams on the road that leave no gap to the next, and of those that do: such road may go unseen."""
SHARE_COLOURS = ("#dcebf6", "#a9cfe9", "#6fa9d4", "#2c72a8", "#123f68")
"""Whole sites, from the least coverage or the fewest returns to the most; lightness alone tells them apart."""
HIDDEN_COLOUR, MISSED_COLOUR = INK, "#a3abb2"
"""Road that something hides from a sensor, and of road in its view that no beam of it returns from."""

SENSOR_COLOURS = ("#f0e442", "#12b886", "#f783c5", "#a8e05f", "#d6358c", "#7ff0d8", "#1f9d8a", "#cfd8dc")
"""Points of each sensor, on a dark ground; neighbours differ in lightness too."""
SENSOR_BODY, SIGHT_LINE = "#f2c230", "#ffd940"
POLE_COLOUR, ASSUMED_POLE_COLOUR = "#f2c94c", "#8a7400"
"""Poles, which may carry a sensor."""

WEIGHTED, FORBIDDEN, MANDATORY = "#5d1f7d", "#8f1d2c", "#4b3fb0"
REGION_VEIL, WEIGHTED_VEIL, FORBIDDEN_VEIL, MANDATORY_VEIL = "#d9d2ee", "#c04df0", "#f0304f", "#6f5dff"
"""Areas in the viewport, where three quarters of what is below shine through."""
WEIGHT_COLOURS = ("#f1e6f7", "#d7b8e8", "#b584d3", "#8a4fb3", "#4f2374")
"""From the lightest weight to the heaviest, in the hue of weighted areas; lightness alone tells them apart."""

MAP_GROUND, MAP_STREETS, MAP_JUNCTION = "#17191b", ("#53575b", "#83888d", "#b4b9be"), "#ffffff"
"""The map on which a junction is chosen: streets by importance. Greys: nothing on it is coverage or a sensor."""
PAPER_STREETS = ("#e3e7ea", "#cfd5d9", "#b7bfc5")
"""Streets on a map of sites, on paper, by importance."""
SERIES_COLOURS = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
"""Series of a chart, distinct for colour-blind readers (Okabe and Ito 2008)."""
NEW_COLOUR, GONE_COLOUR = "#d1242f", SERIES_COLOURS[1]
"""Objects that a scene lacks, and those that are no longer there."""

STATIC_COLOUR = "#7d8790"  # of points on what stands still, where road users have colours
INTENSITY_COLOURS = ("#27408b", "#1fa187", "#fde725", "#ffffff")
"""From no intensity to `MAX_INTENSITY`, evenly spaced along its square root."""
MAX_INTENSITY = 0.6  # intensity from which on returns have the last colour; below, colours go by its square root


def rgb(colour: str) -> tuple[float, float, float]:
    """Return a web colour as shares of red, green and blue."""
    red, green, blue = (int(colour[at : at + 2], 16) / 255.0 for at in (1, 3, 5))
    return red, green, blue
