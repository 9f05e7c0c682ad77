"""Where new posts may stand: on the map's pavements, and on verges where a side of a road has none."""

import math

import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.site.roles import Role
from seip_addon.core.world.streetscape.description import SiteDescription
from tests.builders.map_models import site_model
from tests.builders.opendrive_text import document, geometry, lane, read_text, road, section

HERE = SiteDescription(near=(50.0, 0.0), radius=40.0)


def built(tmp_path, *roads, place=HERE, rest=""):
    return finish(site_model(read_text(tmp_path, document(*roads, rest=rest)), place))


def area(model, name, roles=(Role.CANDIDATE_AREAS,)):
    """Return the union in plan of the parts of a name, map coordinates."""
    faces = [
        shapely.Polygon(part.solid.vertices[list(face), :2])
        for part in model.parts
        if part.name == name and set(roles) <= set(part.roles)
        for face in part.solid.faces
    ]
    return shapely.transform(shapely.union_all(faces), lambda xy: xy + model.origin[:2])


def test_a_pavement_on_one_side_leaves_the_verge_on_the_other(tmp_path):
    model = built(tmp_path, road(sections=section(lane(1), lane(-1), lane(2, 2.0, "sidewalk"))))
    verge = area(model, "Verge strip")
    assert verge.intersection(shapely.box(10, -9, 90, 0)).area == pytest.approx(80 * 1.5, rel=0.02)
    assert verge.intersection(shapely.box(10, 0, 90, 9)).area < 1e-6
    assert area(model, "Pavements").area > 100
    assert any("m of roadside have no pavement" in note for note in model.notes)


@pytest.mark.parametrize("x", [15.0, 85.0])
def test_no_verge_lies_across_the_end_of_the_road(tmp_path, x):
    """The carriageway goes on where the map ends, in front of it and 2.3 m to its sides."""
    place = SiteDescription(near=(x, 0.0), radius=40.0)
    verge = area(built(tmp_path, road(sections=section(lane(1), lane(-1))), place=place), "Verge strip")
    assert verge.area > 100
    low, _, high, _ = verge.bounds
    assert low > -0.2
    assert high < 100.2


def crossing(paved):
    """Two streets of 7 m with pavements that end at a junction of 10 m; ``paved``: it has some at its own corners."""
    walks = [lane(2, 2.0, "sidewalk"), lane(-2, 2.0, "sidewalk")]
    arms = [
        road(geometry(length=60.0, x=5 * math.cos(a), y=5 * math.sin(a), hdg=a),
             section(lane(1), lane(-1), *walks), number=str(n))
        for n, a in enumerate((0.0, math.pi / 2, math.pi, 3 * math.pi / 2))
    ]  # fmt: skip
    through = [
        road(geometry(length=10.0, x=-5 * math.cos(a), y=-5 * math.sin(a), hdg=a),
             section(lane(1), lane(-1)), number=str(8 + n), junction="7")
        for n, a in enumerate((0.0, math.pi / 2))
    ]  # fmt: skip
    corners = [
        road(geometry(length=1.0, x=x, y=y), section(lane(1, 1.0, "sidewalk")), number=str(20 + n), junction="7")
        for n, (x, y) in enumerate(((3.5, 3.5), (-4.5, 3.5), (-4.5, -4.5), (3.5, -4.5)))
    ]
    return (*arms, *through, *(corners if paved else ()))


def test_what_is_added_round_corners_is_told_and_nothing_is_where_the_map_has_pavements(tmp_path):
    place = SiteDescription(near=(0.0, 0.0), radius=30.0)
    rest = '<junction id="7" name="crossing"/>'
    closed = built(tmp_path, *crossing(paved=False), place=place, rest=rest)
    own = built(tmp_path, *crossing(paved=True), place=place, rest=rest)
    (note,) = [note for note in closed.notes if "closed at the corners" in note]
    assert "9 m² are added to its" in note  # four squares of 1.5 m
    assert area(closed, "Pavements").area - area(own, "Pavements").area == pytest.approx(4 * (1.5**2 - 1), abs=0.05)
    assert not any("closed at the corners" in note for note in own.notes)


@pytest.mark.parametrize(("gap", "has_verge"), [(4.0, False), (15.0, True)])
def test_a_narrow_median_is_no_roadside(tmp_path, gap, has_verge):
    """Two carriageways that no junction joins: no post stands between them unless there is room."""
    roads = [road(geometry(y=y), section(lane(1), lane(-1)), number=str(n)) for n, y in enumerate((0.0, 7.0 + gap))]
    verge = area(built(tmp_path, *roads), "Verge strip")
    between = shapely.box(10, 3.5, 90, 3.5 + gap)
    assert verge.intersects(between) == has_verge
    assert verge.intersects(shapely.box(10, -9, 90, -3.5))


def rising(grade, z=0.0):
    return f'<elevation s="0" a="{z}" b="{grade}" c="0" d="0"/>'


def two_roads(grade=0.0, step=0.0, *, turned=False):
    """Return a street of two roads that lead into each other at (0, 0); the second may be laid the other way."""
    lanes = section(lane(1), lane(-1))
    first = road(geometry(length=60.0, x=-60.0), lanes, number="1", elevation=rising(grade))
    start = {"x": 60.0, "hdg": np.pi} if turned else {"x": 0.0, "hdg": 0.0}
    second = road(geometry(length=60.0, **start), lanes, number="2", elevation=rising(0.0, 60 * grade + step))
    contact = "end" if turned else "start"
    link = f'<link><successor elementType="road" elementId="2" contactPoint="{contact}"/></link>'
    return document(first.replace("<planView>", f"{link}<planView>", 1), second)


def warnings(tmp_path, text):
    model = finish(site_model(read_text(tmp_path, text), SiteDescription(near=(0.0, 0.0), radius=50.0)))
    return list(model.warnings)


@pytest.mark.parametrize(("grade", "steep"), [(0.0, False), (-0.12, False), (0.125, True), (0.2, True), (-1.4, True)])
def test_a_carriageway_steeper_than_any_street_is_named(tmp_path, grade, steep):
    found = warnings(tmp_path, two_roads(grade))
    assert bool(found) == steep
    if steep:
        assert found[0].startswith(f"carriageways are steeper than 12%: up to {abs(grade):.1%} on road 1 at (-")


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("step", "warned"), [(0.0, False), (0.05, False), (0.4, True), (-6.0, True)])
def test_a_step_between_roads_that_lead_into_each_other_is_named(tmp_path, step, warned, turned):
    found = warnings(tmp_path, two_roads(0.0, step, turned=turned))
    assert bool(found) == warned
    if warned:
        assert f"differ in height by {abs(step):.2f} m on road 1 at (0, 2)" in found[0]
