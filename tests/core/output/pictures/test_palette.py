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
    FORBIDDEN,
    INK,
    MANDATORY,
    PAPER,
    RETURNS_COLOURS,
    SEEN_COLOURS,
    SENSOR_COLOURS,
    SHARE_COLOURS,
    WEIGHT_COLOURS,
    WEIGHTED,
    rgb,
)
from seip_addon.core.output.pictures.plan_map import LAND, PAVEMENT, ROAD

GROUPS = {"coverage": COVERAGE_COLOURS, "sensors": ALL_SENSOR_COLOURS, "areas": AREA_COLOURS}
ADD_ON = Path(__file__).resolve().parents[4] / "seip_addon"
GROUNDS = (LAND, PAVEMENT, ROAD)
XYZ = np.array(
    [(0.4124564, 0.3575761, 0.1804375), (0.2126729, 0.7151522, 0.0721750), (0.0193339, 0.1191920, 0.9503041)]
)
"""CIE XYZ of linear sRGB (IEC 61966-2-1)."""
SIGHTS = {
    "normal": np.eye(3),
    "protanopia": np.array(
        [(0.152286, 1.052583, -0.204868), (0.114503, 0.786281, 0.099216), (-0.003882, -0.048116, 1.051998)]
    ),
    "deuteranopia": np.array(
        [(0.367322, 0.860646, -0.227968), (0.280085, 0.672501, 0.047413), (-0.011820, 0.042940, 0.968881)]
    ),
    "tritanopia": np.array(
        [(1.255528, -0.076749, -0.178779), (-0.078411, 0.930809, 0.147602), (0.004733, 0.691367, 0.303900)]
    ),
}
"""Linear sRGB as people without one kind of cone see it: Machado, Oliveira and Fernandes (2009), severity 1."""
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


@pytest.mark.parametrize("colours", [SEEN_COLOURS, SHARE_COLOURS, WEIGHT_COLOURS])
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


def linear(colour):
    return np.array([v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in rgb(colour)])


def cielab(light):
    """Return L*, a* and b* of linear red, green and blue, after CIE 15 with the white D65."""
    xyz = XYZ @ light / (XYZ @ np.ones(3))
    root = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    return np.array((116 * root[1] - 16, 500 * (root[0] - root[1]), 200 * (root[1] - root[2])))


def seen_as(colour, sight):
    """Return CIELAB of a colour as people see it with a kind of colour vision, or as grey print shows it."""
    light = linear(colour)
    return cielab(np.full(3, XYZ[1] @ light) if sight == "grey" else np.clip(SIGHTS[sight] @ light, 0.0, 1.0))


def apart(one, other, sight):
    return float(np.linalg.norm(seen_as(one, sight) - seen_as(other, sight)))


def test_cielab_of_the_primaries_is_that_of_the_literature():
    assert seen_as("#ff0000", "normal") == pytest.approx((53.24, 80.09, 67.20), abs=0.05)
    assert seen_as("#0000ff", "normal") == pytest.approx((32.30, 79.19, -107.86), abs=0.05)
    assert seen_as("#ffffff", "grey") == pytest.approx((100.0, 0.0, 0.0), abs=0.01)


def test_protanopes_take_red_for_dark_and_confuse_it_with_green():
    """Who lacks a cone sees a pure red nearer to green than others do; greys look the same to everybody."""
    for sight in ("protanopia", "deuteranopia"):
        assert apart("#d02020", "#208020", sight) < apart("#d02020", "#208020", "normal") / 2
        assert seen_as("#808080", sight) == pytest.approx(seen_as("#808080", "normal"), abs=0.2)
    assert seen_as("#ff0000", "protanopia")[0] < seen_as("#ff0000", "normal")[0] - 10


@pytest.mark.parametrize("sight", [*SIGHTS, "grey"])
def test_classes_of_coverage_and_sensors_stay_apart_for_every_eye_and_in_grey_print(sight):
    """5 units are a clear difference side by side, and 10 at a glance; classes of returns are a finer scale."""
    for colours, least in ((SEEN_COLOURS, 10.0), (RETURNS_COLOURS, 7.0)):
        assert min(apart(one, other, sight) for one, other in combinations(colours, 2)) > least
    marks = (INK, PAPER)  # of sensors on plan and view: dark with a light border
    assert min(apart(mark, road, sight) for mark in marks[:1] for road in (*RETURNS_COLOURS, *GROUNDS)) > 25.0
    assert min(apart(mark, road, sight) for mark in marks[1:] for road in SEEN_COLOURS) > 20.0


@pytest.mark.parametrize("sight", SIGHTS)
def test_areas_stay_apart_from_coverage_and_from_each_other_for_every_eye(sight):
    """In grey, patterns tell areas apart: dashes, strokes and dots."""
    areas = (WEIGHTED, FORBIDDEN, MANDATORY)
    assert min(apart(one, other, sight) for one, other in combinations(areas, 2)) > 15.0
    assert min(apart(area, road, sight) for area in areas for road in RETURNS_COLOURS) > 15.0


@pytest.mark.parametrize("sight", [*SIGHTS, "grey"])
def test_areas_and_coverage_stay_apart_from_what_the_plan_shows_around_them(sight):
    for ground in GROUNDS:
        assert min(apart(colour, ground, sight) for colour in (WEIGHTED, FORBIDDEN, MANDATORY)) > 30.0
        assert min(apart(colour, ground, sight) for colour in SEEN_COLOURS) > 10.0


def test_no_other_module_states_a_colour():
    stated = {
        (path.name, colour)
        for path in ADD_ON.rglob("*.py")
        for colour in re.findall(r"#[0-9a-fA-F]{6}", path.read_text(encoding="utf-8"))
        if path.name != "palette.py" and oklch(colour)[1] >= NEUTRAL
    }
    assert stated == set()
