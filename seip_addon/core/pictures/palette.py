"""Colours and words that pictures and the scene share; told apart by colour-blind people and on grey paper."""

INK = "#1d2b36"
SOFT_INK = "#5d6b76"
PAPER = "#ffffff"

SEEN_TWICE = 2
SEEN_COLOURS = ("#e8823c", "#8cc4e2", "#2c72a8")
"""Of targets that no sensor, one sensor, two sensors or more see; lightness differs as well as hue."""
SEEN_WORDS = ("not seen", "seen by one sensor", "seen by two or more")
