"""Colours shared by pictures and the scene; distinct for colour-blind readers and in greyscale."""

INK = "#1d2b36"
SOFT_INK = "#5d6b76"
PAPER = "#ffffff"

SEEN_TWICE = 2
SEEN_COLOURS = ("#e8823c", "#8cc4e2", "#2c72a8")
"""Of targets that no sensor, one sensor, two sensors or more see; lightness differs as well as hue."""
SEEN_WORDS = ("not seen", "seen by one sensor", "seen by two or more")

SENSOR_COLOURS = ("#56b4e9", "#e69f00", "#3cc99b", "#f07ac0", "#f0e442", "#d55e00", "#8f9bff", "#cfd8dc")
"""Told apart by colour-blind people, on a dark ground (after Okabe and Ito 2008)."""
INTENSITY_COLOURS = ("#27408b", "#1fa187", "#fde725", "#ffffff")
"""From no intensity to `MAX_INTENSITY`, evenly spaced along its square root."""
MAX_INTENSITY = 0.6  # intensity from which on returns have the last colour; below, colours go by its square root


def rgb(colour: str) -> tuple[float, float, float]:
    """Return a web colour as shares of red, green and blue."""
    red, green, blue = (int(colour[at : at + 2], 16) / 255.0 for at in (1, 3, 5))
    return red, green, blue
