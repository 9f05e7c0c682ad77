"""Colours of coverage, sensors and areas: no hue means two things, and one module states them all."""

import math
import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from seip_addon.core.output.pictures.palette import (
    ALL_SENSOR_COLOURS,
    AREA_COLOURS,
    COVERAGE_COLOURS,
    SEEN_COLOURS,
    SENSOR_COLOURS,
    WEIGHT_COLOURS,
    rgb,
)

GROUPS = {"coverage": COVERAGE_COLOURS, "sensors": ALL_SENSOR_COLOURS, "areas": AREA_COLOURS}
ADD_ON = Path(__file__).resolve().parents[4] / "seip_addon"
NEUTRAL = 0.04
"""Chroma of OKLab below which a colour is a grey."""
APART = 20.0
"""Degrees of hue between two colours that mean different things."""


def oklch(colour):
    """Return lightness, chroma and hue (degrees) of a web colour, after Ottosson (2020)."""
    linear = np.array([v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in rgb(colour)])
    cones = np.cbrt(
        np.array(
            [
                (0.4122214708, 0.5363325363, 0.0514459929),
                (0.2119034982, 0.6806995451, 0.1073969566),
                (0.0883024619, 0.2817188376, 0.6299787005),
            ]
        )
        @ linear
    )
    light, a, b = (
        np.array(
            [
                (0.2104542553, 0.7936177850, -0.0040720468),
                (1.9779984951, -2.4285922050, 0.4505937099),
                (0.0259040371, 0.7827717662, -0.8086757660),
            ]
        )
        @ cones
    )
    return light, math.hypot(a, b), math.degrees(math.atan2(b, a)) % 360.0


def hues(colours):
    return [hue for _, chroma, hue in map(oklch, colours) if chroma >= NEUTRAL]


def test_red_green_and_blue_have_the_hues_that_ottosson_gives():
    primaries = [oklch(colour)[2] for colour in ("#ff0000", "#00ff00", "#0000ff")]
    assert primaries == pytest.approx([29.2, 142.5, 264.1], abs=0.1)


@pytest.mark.parametrize(("one", "other"), [*combinations(GROUPS, 2)])
def test_groups_share_no_hue(one, other):
    differences = np.subtract.outer(hues(GROUPS[one]), hues(GROUPS[other]))
    assert differences.size > 20
    assert np.abs((differences + 180.0) % 360.0 - 180.0).min() >= APART


@pytest.mark.parametrize("colours", [SEEN_COLOURS, WEIGHT_COLOURS])
def test_classes_differ_in_lightness_too(colours):
    lightness = np.sort([oklch(colour)[0] for colour in colours])
    assert np.diff(lightness).min() > 0.07


def test_sensors_are_told_apart_and_neighbours_best():
    polar = map(oklch, SENSOR_COLOURS)
    places = [
        (light, *(chroma * turn(math.radians(hue)) for turn in (math.cos, math.sin))) for light, chroma, hue in polar
    ]
    assert min(math.dist(one, other) for one, other in combinations(places, 2)) > 0.07
    assert min(map(math.dist, places, places[1:])) > 0.15


def test_no_other_module_states_a_colour():
    stated = {
        (path.name, colour)
        for path in ADD_ON.rglob("*.py")
        for colour in re.findall(r"#[0-9a-fA-F]{6}", path.read_text(encoding="utf-8"))
        if path.name != "palette.py" and oklch(colour)[1] >= NEUTRAL
    }
    assert stated == set()
