"""New posts keep off cycle tracks, driveways, landings, private ground and narrow islands, unless allowed."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from seip_addon.core.base.errors import SeipError
from seip_addon.core.site.candidates import generate_candidates
from seip_addon.core.site.post_rules import RULES, KeepOffArea
from seip_addon.core.site.scene_geometry import Mesh, Pole
from tests.builders.plain_street import PLAIN, sheet, street

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
