"""Candidates stand where a post can stand, evenly, and nowhere else."""

import re
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.site.candidates import generate_candidates
from seip_addon.core.site.pavement_sampling import spread
from seip_addon.core.site.post_rules import RULES, KeepOffArea
from seip_addon.core.site.scene_geometry import Mesh, NamedArea, Pole
from seip_addon.core.site.site import make_site
from tests.builders.plain_street import PLAIN, block, sheet, street


def test_candidates_and_targets_that_do_not_fit_in_memory_are_refused_before_any_is_tested():
    heights = tuple(np.linspace(3.0, 23.0, 2001).tolist())
    with pytest.raises(SeipError, match=r"positions × 2,001 heights .* too many") as refused:
        make_site(street(), replace(PLAIN, heights=heights, spacing=0.5), 0.2)
    most = int(re.search(r"at most ([\d,]+)", str(refused.value))[1].replace(",", ""))
    assert len(generate_candidates(street(), PLAIN, most)) < most


def one_by_one(area, spacing):
    """A point of the fine grid is taken unless one taken before is too near."""
    low_x, low_y, high_x, high_y = area.bounds
    taken = np.empty((0, 2))
    for x in np.arange(low_x + spacing / 16, high_x, spacing / 8):
        for y in np.arange(low_y + spacing / 16, high_y, spacing / 8):
            free = (np.hypot(taken[:, 0] - x, taken[:, 1] - y) >= spacing * (1 - 1e-9)).all()
            if free and shapely.intersects_xy(area, x, y):
                taken = np.vstack((taken, (x, y)))
    return taken


@pytest.mark.slow
@settings(max_examples=15)
@given(spacing=st.floats(1.5, 6.0), angle=st.floats(0, 3), width=st.floats(0.2, 20.0), hole=st.floats(0.1, 8.0))
def test_spread_is_the_same_as_one_by_one(spacing, angle, width, hole):
    area = shapely.affinity.rotate(shapely.box(0, 0, 30, width), angle, use_radians=True)
    area = area.difference(area.centroid.buffer(hole))
    np.testing.assert_array_equal(spread(area, spacing), one_by_one(area, spacing))


def test_a_pole_carries_its_sensor_on_a_bracket_towards_the_region():
    pole = Pole("signal", np.array((0.0, 9.0, 0.1)))
    candidates = generate_candidates(street(candidate_areas=shapely.Polygon(), poles=(pole,)), PLAIN)
    assert candidates.position_name.tolist() == ["signal"]
    assert candidates.on_pole.all()
    np.testing.assert_allclose(candidates.xyz, [(0, 8.6, 3.6), (0, 8.6, 8.1)])


def test_no_sensor_hangs_above_its_pole():
    poles = (Pole("low", np.array((0.0, 9.0, 0.1)), 6.0), Pole("mark", np.array((20.0, 9.0, 0.1))))
    candidates = generate_candidates(
        street(candidate_areas=shapely.Polygon(), poles=poles), replace(PLAIN, heights=(3.5, 6.5, 6.6, 8.0))
    )
    heights = {name: candidates.height[candidates.position_of == i] for i, name in enumerate(candidates.position_name)}
    assert heights["low"].tolist() == [3.5, 6.5]
    assert heights["mark"].tolist() == [3.5, 6.5, 6.6, 8.0]
    assert candidates.dropped["higher than the pole"] == 2


def test_what_lies_inside_an_object_is_dropped_and_counted():
    shed = Mesh("shed", block((-5, 6.5, 0), (5, 12, 5)))
    candidates = generate_candidates(street(occluders=(shed,)), replace(PLAIN, heights=(3.5,)))
    assert (np.abs(candidates.position[:, 0]) > 5).all()
    assert candidates.dropped["inside an object"] >= 2


def test_candidates_whose_pairs_do_not_fit_in_memory_are_refused():
    heights = tuple(np.linspace(3.0, 8.0, 401))
    with pytest.raises(SeipError, match=r"× 401 heights .* at most 40,000 are possible"):
        make_site(street(), replace(PLAIN, heights=heights, spacing=0.5), 20.0)  # few targets


@pytest.mark.parametrize(("above", "free"), [(0.2, False), (0.4, True)])
def test_a_sensor_keeps_its_clearance_from_what_is_above_it(above, free):
    low = 0.1 + 3.5 + above
    roof = Mesh("roof", block((-60, 0, low), (60, 20, low + 1)))
    settings = replace(PLAIN, heights=(3.5,), clearance=0.3)
    if free:
        assert len(generate_candidates(street(occluders=(roof,)), settings))
    else:
        with pytest.raises(SeipError, match="too close to a wall or object"):
            generate_candidates(street(occluders=(roof,)), settings)


def test_forbidden_areas_and_poles_are_left_out():
    poles = (Pole("a", np.array((0.0, 9.0, 0.1)), forbidden=True), Pole("b", np.array((9.0, 9.0, 0.1))))
    area = NamedArea("museum", shapely.box(-40, 0, -10, 20))
    candidates = generate_candidates(street(poles=poles, forbidden_areas=(area,)), PLAIN)
    assert "a" not in candidates.position_name
    assert "b" in candidates.position_name
    assert candidates.position[:, 0].min() > -10
    assert candidates.dropped["on a forbidden pole"] == 1
    assert candidates.dropped["in a forbidden area"] > 0


def test_mandatory_places_become_groups():
    poles = (Pole("signal", np.array((0.0, 9.0, 0.1)), mandatory=True),)
    area = NamedArea("school", shapely.box(10, 0, 20, 20))
    candidates = generate_candidates(street(poles=poles, mandatory_areas=(area,)), PLAIN)
    assert candidates.mandatory_name.tolist() == ["signal", "school"]
    assert candidates.mandatory[0].sum() == 1
    inside = (candidates.position[:, 0] >= 10) & (candidates.position[:, 0] <= 20)
    assert candidates.mandatory[1].tolist() == inside.tolist()


@given(st.permutations(range(4)))
def test_names_and_order_of_poles_change_no_place(order):
    feet = np.array([(x, 9.0, 0.1) for x in (-20.0, -3.0, 5.0, 17.0)])
    poles = tuple(Pole(f"pole {i}", feet[i]) for i in range(4))
    one = generate_candidates(street(poles=poles), PLAIN)
    two = generate_candidates(street(poles=tuple(replace(poles[i], name=f"x{i}") for i in order)), PLAIN)
    assert one.xyz.tobytes() == two.xyz.tobytes()


@pytest.mark.parametrize(
    ("changes", "options", "sentence"),
    [
        ({"candidate_areas": shapely.Polygon()}, {}, "no candidate"),
        ({"occluders": (Mesh("hall", block((-90, -90, -1), (90, 90, 30))),)}, {}, r"no candidate is left \(\d+ inside"),
        ({}, {"heights": (-1.0,)}, "mounting height must be a positive"),
        (
            {"poles": (Pole("stub", np.array((0.0, 9.0, 0.1)), 2.0, mandatory=True),)},
            {},
            "'stub' must carry.*lower heights",
        ),
        (
            {"poles": (Pole("p", np.array((0.0, 9.0, 0.1)), forbidden=True, mandatory=True),)},
            {},
            "'p' is both forbidden and mandatory",
        ),
    ],
)
def test_each_fault_has_its_sentence(changes, options, sentence):
    with pytest.raises(SeipError, match=sentence):
        generate_candidates(street(**changes), replace(PLAIN, **options))


TRACK = shapely.box(-40, 7, 0, 10)
AREA_RULES = [rule for rule in RULES if rule not in ("islands", "power-poles")]


def posts(geometry, **changes):
    candidates = generate_candidates(geometry, replace(PLAIN, **changes))
    return candidates.position[:, :2], candidates.dropped


@pytest.mark.parametrize("rule", AREA_RULES)
def test_new_posts_keep_off_an_area_unless_its_rule_is_allowed(rule):
    scene = street(keep_off_areas=(KeepOffArea("there", TRACK, rule),))
    everywhere, _ = posts(street())
    plan, dropped = posts(scene)
    distance = shapely.distance(TRACK, shapely.points(plan))
    assert distance.min() > RULES[rule].clearance
    assert dropped[RULES[rule].reason] == len(everywhere) - len(plan) > 5
    allowed, dropped = posts(scene, allow=(rule,))
    np.testing.assert_array_equal(allowed, everywhere)
    assert RULES[rule].reason not in dropped
    others = tuple(other for other in RULES if other != rule)
    np.testing.assert_array_equal(posts(scene, allow=others)[0], plan)


def median(width):
    """Two carriageways along x with a median between them, on which posts may stand, and no pavement."""
    roads = (Mesh("north", sheet(-40, width / 2, 40, 12)), Mesh("south", sheet(-40, -12, 40, -width / 2)))
    area = shapely.box(-40, -width / 2, 40, width / 2)
    ground = (Mesh("median", sheet(-40, -width / 2, 40, width / 2, 0.1)),)
    return street(roads=roads, ground=ground, candidate_areas=area, region=shapely.box(-30, -12, 30, 12))


@pytest.mark.parametrize(("width", "allowed"), [(3.9, False), (4.1, True)])
def test_medians_narrower_than_four_metres_hold_no_posts(width, allowed):
    scene = median(width)
    if allowed:
        assert len(posts(scene)[0]) > 10
    else:
        with pytest.raises(SeipError, match=r"island narrower than 4 m.*allow islands"):
            posts(scene)
    assert len(posts(scene, allow=("islands",))[0]) > 10


def test_power_poles_carry_nothing_unless_they_are_allowed():
    poles = (
        Pole("lamp", np.array((0.0, 9.0, 0.1))),
        Pole("mains", np.array((9.0, 9.0, 0.1)), keep_off="power-poles"),
        Pole("meant", np.array((18.0, 9.0, 0.1)), keep_off="power-poles", mandatory=True),
    )
    plain = generate_candidates(street(poles=poles), PLAIN)
    assert set(plain.position_name[plain.on_pole]) == {"lamp", "meant"}
    assert plain.dropped["on a power pole"] == 1
    asked = generate_candidates(street(poles=poles), replace(PLAIN, allow=("power-poles",)))
    assert set(asked.position_name[asked.on_pole]) == {"lamp", "mains", "meant"}
