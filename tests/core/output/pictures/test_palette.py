"""Colours: which stay apart for whom, the classes of targets, two placements compared, and texts that keep counts."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.output.pictures.palette import (
    BOTH,
    INK,
    KEPT_ONLY,
    NEITHER,
    PAPER,
    PRESENT_ONLY,
    RETURNS_COLOURS,
    SEEN_COLOURS,
    colouring,
    compare,
    packed_counts,
    rgb,
    unpacked_counts,
)
from seip_addon.core.output.pictures.plan_view import LAND, PAVEMENT, ROAD

SEEN_BY = np.array([0, 1, 2, 3, 7, 0])
WEIGHT = np.array([1.0, 1.0, 2.0, 4.0, 2.0, 1.0])
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


@pytest.mark.parametrize(
    ("aspect", "words", "of"),
    [
        ("seen", ("not seen", "seen"), [0, 1, 1, 1, 1, 0]),
        ("times", ("not seen", "seen by one sensor", "seen by two or more"), [0, 1, 2, 2, 2, 0]),
        ("weights", ("weight 1", "weight 2", "weight 4"), [0, 0, 1, 2, 1, 0]),
    ],
)
def test_each_aspect_has_its_classes(aspect, words, of):
    found = colouring(aspect, SEEN_BY, WEIGHT)
    assert (found.words, found.of.tolist()) == (words, of)
    assert len(set(found.colours)) == len(words)
    assert found.shares == pytest.approx(np.bincount(of) / len(of))


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3)), min_size=1, max_size=50))
def test_shares_are_those_of_sets_of_targets(pairs):
    kept, present = ({i for i, pair in enumerate(pairs) if pair[side]} for side in (0, 1))
    packed = [packed_counts(np.array([pair[side] for pair in pairs], dtype=np.int64)) for side in (0, 1)]
    shares = compare(*map(unpacked_counts, packed)).shares
    for number, targets in ((BOTH, kept & present), (KEPT_ONLY, kept - present), (PRESENT_ONLY, present - kept)):
        assert shares[number] == len(targets) / len(pairs)
    assert shares[NEITHER] == (len(pairs) - len(kept | present)) / len(pairs)
