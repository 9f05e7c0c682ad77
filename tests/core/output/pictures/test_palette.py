"""Colours of coverage, sensors and areas: no hue means two things, and one module states them all."""

import math
import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from seip_addon.core.output.pictures.palette import (
    INK,
    PAPER,
    RETURNS_COLOURS,
    SEEN_COLOURS,
    rgb,
)
from seip_addon.core.output.pictures.plan_map import LAND, PAVEMENT, ROAD

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


@pytest.mark.parametrize("sight", [*SIGHTS, "grey"])
def test_classes_of_coverage_and_sensors_stay_apart_for_every_eye_and_in_grey_print(sight):
    """5 units are a clear difference side by side, and 10 at a glance; classes of returns are a finer scale."""
    for colours, least in ((SEEN_COLOURS, 10.0), (RETURNS_COLOURS, 7.0)):
        assert min(apart(one, other, sight) for one, other in combinations(colours, 2)) > least
    marks = (INK, PAPER)  # of sensors on plan and view: dark with a light border
    assert min(apart(mark, road, sight) for mark in marks[:1] for road in (*RETURNS_COLOURS, *GROUNDS)) > 25.0
    assert min(apart(mark, road, sight) for mark in marks[1:] for road in SEEN_COLOURS) > 20.0


def test_no_other_module_states_a_colour():
    stated = {
        (path.name, colour)
        for path in ADD_ON.rglob("*.py")
        for colour in re.findall(r"#[0-9a-fA-F]{6}", path.read_text(encoding="utf-8"))
        if path.name != "palette.py" and oklch(colour)[1] >= NEUTRAL
    }
    assert stated == set()
