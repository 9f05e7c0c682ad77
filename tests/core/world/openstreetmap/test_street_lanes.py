"""Numbers of lanes of streets, and where the lanes lie across the lines of their ways."""

import pytest

from seip_addon.core.world.openstreetmap.quantities import count, metres
from seip_addon.core.world.openstreetmap.street_lanes import divider_offset, has_lane_count, lane_counts

TWO_WAY = {"highway": "primary"}
ONE_WAY = {"highway": "primary", "oneway": "yes"}


@pytest.mark.parametrize(
    ("tags", "lanes"),
    [
        (TWO_WAY, (1, 1)),
        (TWO_WAY | {"lanes": "4"}, (2, 2)),
        (TWO_WAY | {"lanes": "3", "lanes:backward": "1"}, (2, 1)),
        (TWO_WAY | {"lanes": "3", "lanes:forward": "2"}, (2, 1)),
        (TWO_WAY | {"lanes": "2", "lanes:forward": "2", "lanes:backward": "1"}, (2, 1)),
        (TWO_WAY | {"turn:lanes:backward": "left|through"}, (1, 2)),
        (TWO_WAY | {"lanes": "many"}, (1, 1)),
        (TWO_WAY | {"lanes": "1"}, (1, 1)),
        ({"highway": "motorway"}, (2,)),
        ({"highway": "motorway_link"}, (1,)),
        ({"highway": "trunk"}, (1, 1)),
        ({"highway": "trunk", "oneway": "yes"}, (2,)),
        (TWO_WAY | {"junction": "roundabout"}, (1,)),
        (ONE_WAY | {"lanes": "3"}, (3,)),
        (ONE_WAY | {"lanes:forward": "2"}, (2,)),
        (ONE_WAY | {"turn:lanes": "left|through|"}, (3,)),
        # with a lane against the traffic
        (ONE_WAY | {"oneway:bus": "no", "lanes": "2", "lanes:forward": "1", "lanes:backward": "1"}, (1, 1)),
        (ONE_WAY | {"oneway:psv": "no", "lanes": "3"}, (2, 1)),
        (ONE_WAY | {"oneway:bus": "no"}, (1, 1)),
        (ONE_WAY | {"oneway:bus": "no", "lanes": "1"}, (1,)),
        (ONE_WAY | {"busway": "opposite_lane", "lanes": "1"}, (1, 1)),
        (ONE_WAY | {"lanes": "3", "lanes:bus:backward": "1"}, (2, 1)),
    ],
)
def test_number_of_lanes(tags, lanes):
    assert tuple(lane_counts(tags).values()) == lanes


@pytest.mark.parametrize(
    ("tags", "known"),
    [
        (TWO_WAY, False),
        (TWO_WAY | {"lanes": "0"}, False),
        (TWO_WAY | {"lanes": "2"}, True),
        (TWO_WAY | {"lanes:forward": "1"}, False),
        (TWO_WAY | {"lanes:forward": "1", "turn:lanes:backward": "left|right"}, True),
        (ONE_WAY | {"turn:lanes": "left|right"}, True),
    ],
)
def test_whether_the_extract_gives_the_number_of_lanes(tags, known):
    assert has_lane_count(tags) is known


@pytest.mark.parametrize(
    ("tags", "right_hand", "left_hand"),
    [
        ({"lanes": "2"}, 0.0, 0.0),
        ({"lanes": "7", "lanes:forward": "5", "lanes:backward": "2"}, -4.8, 4.8),
        ({"oneway": "yes", "lanes": "3", "sidewalk": "right"}, -4.8, 4.8),
        ({"lanes": "2", "cycleway:right": "lane"}, -0.75, -0.75),
        ({"lanes": "2", "cycleway:right": "track"}, 0.0, 0.0),
        ({"oneway": "yes", "lanes": "1", "cycleway": "opposite_lane"}, -0.85, 0.85),
        ({"oneway": "yes", "lanes": "3", "placement": "right_of:1"}, -3.2, 6.4),
        ({"oneway": "yes", "lanes": "3", "placement": "middle_of:3"}, -8.0, 1.6),
        ({"oneway": "yes", "lanes": "2", "width:lanes": "3|5", "placement": "left_of:2"}, -3.0, 5.0),
        ({"oneway": "yes", "lanes": "3", "placement": "transition"}, -4.8, 4.8),
        ({"oneway": "yes", "lanes": "3", "placement": "right_of:4"}, -4.8, 4.8),
        ({"lanes": "5", "lanes:forward": "3", "placement:forward": "left_of:1"}, 0.0, 9.6),
        ({"lanes": "5", "lanes:forward": "3", "placement:backward": "middle_of:1"}, 1.6, -4.8),
        ({"lanes": "5", "lanes:forward": "3", "placement": "middle_of:1"}, 4.8, 8.0),
    ],
)
def test_line_between_the_directions(tags, right_hand, left_hand):
    """The line of a way is the middle of the carriageway, or where ``placement`` says; lanes are 3.2 m wide."""
    tags = {"highway": "primary"} | tags
    assert divider_offset(tags, left_hand=False) == pytest.approx(right_hand)
    assert divider_offset(tags, left_hand=True) == pytest.approx(left_hand)


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
