"""Lengths and counts as mappers write them."""

import pytest

from seip_addon.core.world.openstreetmap.quantities import count, metres


@pytest.mark.parametrize(
    ("text", "length"),
    [
        ("12", 12.0),
        ("12.5 m", 12.5),
        ("12,5m", 12.5),
        ("12 ft", 12 * 0.3048),
        ("40'", 40 * 0.3048),
        ("6'6\"", 6.5 * 0.3048),
        ("39 ft 4 in", (39 + 4 / 12) * 0.3048),
        ("12'6", 12.5 * 0.3048),
        ("12\u20196\u201d", 12.5 * 0.3048),
        ("30''", 30 * 0.0254),
        ("300 cm", 3.0),
        ("~18 m", 18.0),
        ("3;4", 4.0),
        ("3; 4 m ;tall", 4.0),
    ],
)
def test_a_length_is_read(text, length):
    assert metres(text, 900.0) == pytest.approx(length)


@pytest.mark.parametrize(("text", "number"), [("4", 4.0), ("2;3", 3.0), ("1.5", 1.5), ("0", 0.0)])
def test_a_count_is_read(text, number):
    assert count(text, 200.0) == number
