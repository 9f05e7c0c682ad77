"""Sites of extracts, with SUMO: ten kinds of junctions, and where things stand in them."""

import dataclasses
import re
import tempfile

import numpy as np
import pytest
import shapely
import shapely.affinity

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.geometry.geo_reference import projection
from seip_addon.core.programs import sumo_programs
from seip_addon.core.site.roles import Role
from seip_addon.core.workflows.site_building import SiteRequest, build_site
from tests.builders.osm_text import (
    JUNCTIONS,
    Extract,
    corner_houses,
    crossing,
    dual_carriageway,
    slope,
)
from tests.few import few
from tests.oracles.face_areas import check_surfaces
from tests.sumo_here import needs_sumo

pytestmark = needs_sumo


def built(extract, tmp_path, **asked):
    path = extract.write(tmp_path / "place.osm")
    asked = {"near_latlon": (extract.latitude, extract.longitude)} | asked
    return finish(build_site(path, SiteRequest(**asked)))


def opendrive(network, tmp_path):
    """Write a network as an OpenDRIVE map, and return its path."""
    source, target = tmp_path / "street.net.xml", tmp_path / "street.xodr"
    source.write_text(network, encoding="utf-8")
    programs = sumo_programs.find_sumo()
    options = ["--sumo-net-file", source, "--opendrive-output", target, "--output.street-names"]
    finish(sumo_programs.run(programs, programs.netconvert, options, "map", tmp_path))
    return target


def plan(model, name):
    """Return the area in plan of the parts whose names begin so."""
    parts = [part for part in model.parts if part.name.startswith(name)]
    faces = [part.solid.vertices[list(face)][:, :2] for part in parts for face in part.solid.faces]
    return shapely.union_all([shapely.Polygon(face).buffer(0) for face in faces if len(face) > 2], grid_size=1e-4)


@pytest.mark.parametrize("name", few(JUNCTIONS, 3))
def test_a_kind_of_junction_becomes_a_sound_site(name, tmp_path):
    site = built(JUNCTIONS[name](), tmp_path)
    model = site.model
    assert model.region.is_valid
    assert model.region.geom_type == "Polygon"
    assert 1000 < model.region.area < 8000
    assert " / " in model.name
    assert not model.warnings
    assert model.attribution == ("© OpenStreetMap contributors (ODbL)",)
    assert site.map_text is not None
    assert f"<!-- {model.attribution[0]} -->" in site.map_text
    for part in model.parts:
        assert np.isfinite(part.solid.vertices).all()
        assert part.source or not {Role.ROADS, Role.GROUND, Role.OCCLUDERS, Role.POLES} & set(part.roles)
    houses = {row.kind: row for row in model.sources()}["Building"]
    assert (houses.source, houses.assumed) == ("extract", 0)
    driving = plan(model, "Driving lanes")
    holes = [ring for part in shapely.get_parts(driving) for ring in part.interiors]
    assert sum(shapely.Polygon(hole).area for hole in holes if shapely.Polygon(hole).area < 30) < 1.0
    check_surfaces(model)


def test_the_region_follows_the_approaches_and_holds_both_carriageways(tmp_path):
    model = built(dual_carriageway(), tmp_path).model
    low_x, low_y, high_x, high_y = model.region.bounds
    assert (low_x, high_x) == (pytest.approx(-90, abs=8), pytest.approx(90, abs=8))
    for y in (-8, 8):
        for x in (-80, 80):
            assert model.region.distance(shapely.Point(x, y)) < 4.0
    assert low_y < -80 < 80 < high_y


def test_a_radius_is_a_circle_without_streets_that_only_pass_by(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "a:b, c"))
    (tmp_path / "a:b, c").mkdir()
    extract = crossing()
    extract.way([(-200, 45), (-10, 55), (200, 70)], highway="motorway", name="Passing")
    extract.way([(-60, -200), (-60, -70), (-40, -60), (200, -60)], highway="residential", name="Behind")
    model = built(extract, tmp_path, radius=70.0).model
    assert max(np.hypot(*np.array(model.region.exterior.coords).T)) < 71.5
    assert not model.region.contains(shapely.Point(-50, 53))


def test_a_slope_is_that_of_the_nodes(tmp_path):
    model = built(slope(), tmp_path).model
    road = next(part for part in model.parts if part.name == "Driving lanes").solid.vertices
    rise = np.polyfit(road[:, 0], road[:, 2], 1)[0]
    assert rise == pytest.approx(0.06, abs=0.004)


ARMS = {
    "five lanes and two": ({"lanes": 7, "lanes:forward": 5, "sidewalk": "right"}, (-11.2, 11.2), (-11.2, 11.2)),
    "drawn against its traffic": ({"oneway": "-1", "lanes": 3, "sidewalk": "left"}, (-4.8, 4.8), (-4.8, 4.8)),
    "one lane for both directions": ({"lanes": 1}, (-1.75, 1.75), (-1.75, 1.75)),
    "buses against the traffic": ({"oneway": "yes", "oneway:bus": "no", "lanes": 2}, (-3.2, 3.2), (-3.2, 3.2)),
    "cycle lane against the traffic": (
        {"oneway": "yes", "cycleway": "opposite_lane", "lanes": 1},
        (-0.85, 2.35),
        (-2.35, 0.85),
    ),
    "line at the first lane": ({"oneway": "yes", "lanes": 3, "placement": "right_of:1"}, (-3.2, 6.4), (-3.2, 6.4)),
    "pavement on one side": ({"oneway": "yes", "lanes": 2, "sidewalk": "left"}, (-3.2, 3.2), (-3.2, 3.2)),
    "unknown class": ({"highway": "road"}, (-3.2, 3.2), (-3.2, 3.2)),
}
"""Arms of two crossings: their tags, and from where to where their lanes reach to the right of the line of the way,
metres, in right-hand and left-hand traffic."""


@pytest.mark.parametrize("left", [False, True])
@pytest.mark.parametrize("first", [0, 4])
def test_lanes_lie_about_the_lines_of_their_ways(left, first, tmp_path):
    extract = Extract(51.5, -0.1) if left else Extract()
    middle = extract.node(0, 0)
    arms = list(ARMS.values())[first : first + 4]
    ends = [(300, 0), (0, 300), (-300, 0), (0, -300)]
    for number, ((tags, *_), end) in enumerate(zip(arms, ends, strict=True)):
        extract.way([middle, end], **({"highway": "secondary", "name": f"Arm {number}"} | tags))
    model = built(extract, tmp_path).model
    driving = shapely.affinity.translate(plan(model, "Driving lanes"), *model.origin[:2])
    assert plan(model, "Pavements").intersection(plan(model, "Driving lanes")).area < 1.0
    noted = "one lane serves both directions of Arm 2, as the extract gives one lane in all"
    assert (noted in model.notes) is (first == 0)
    to_map = projection(model.geo_reference)
    for (_, *expected), (x, y) in zip(arms, ends, strict=True):
        inner, outer = (
            np.array(to_map(*np.radians(extract.place(share * x, share * y)))) - model.header_offset[:2]
            for share in (0.2, 0.25)
        )
        along = (outer - inner) / np.hypot(*(outer - inner))
        right = np.array([along[1], -along[0]])
        across = driving.intersection(shapely.LineString([outer - 30 * right, outer + 30 * right]))
        reach = (shapely.get_coordinates(across) - outer) @ right
        assert (reach.min(), reach.max()) == pytest.approx(expected[left], abs=0.03)


def test_a_place_can_be_named_by_its_streets(tmp_path):
    site = built(crossing(), tmp_path, near_latlon=None, junction=("north road", "East Road"))
    assert set(site.model.name.split(" / ")) == {"East Road", "North Road"}


@pytest.mark.parametrize(
    ("asked", "complaint"),
    [
        ({"near_latlon": None}, "needs a place"),
        ({"near_latlon": (48.0, 2.0)}, "no node near the place"),
        ({"near_latlon": (52.5, 13.4), "osm": "x"}, "is an extract"),
        ({"near_latlon": None, "junction": ("East Road",)}, "two different streets"),
        (
            {"near_latlon": None, "junction": ("East Road", "Nowhere Lane")},
            "no street called 'Nowhere Lane'; the closest",
        ),
        ({"near_latlon": None, "junction": ("East Road", "east road")}, "two different streets"),
        ({"near_latlon": (91.0, 0.0)}, "--near-latlon 91 0 .* latitude first"),
        ({"radius": -5.0}, "--radius -5 .* metres above zero"),
        ({"approaches": 0.0}, "--approaches 0 .* metres above zero"),
    ],
)
def test_a_place_that_is_none_is_refused_in_a_sentence(asked, complaint, tmp_path):
    with pytest.raises(SeipError, match=complaint):
        built(crossing(), tmp_path, **asked)


def test_a_site_description_adds_to_an_extract(tmp_path):
    description = tmp_path / "more.toml"
    description.write_text('name = "Here"\n[[wall]]\nline = [[150, 150], [160, 150]]\n', encoding="utf-8")
    model = built(crossing(), tmp_path, site=description).model
    assert model.name == "Here"
    assert ("Wall", "site description") in {(row.kind, row.source) for row in model.sources()}


def test_an_extract_adds_buildings_to_an_opendrive_map(tmp_path):
    site = built(crossing(), tmp_path)
    assert site.map_text is not None
    map_path = opendrive(site.map_text, tmp_path)
    middle = tuple((site.model.origin[:2] * 1.0).tolist())
    asked = SiteRequest(near=middle, radius=60.0, osm=tmp_path / "place.osm")
    model = finish(build_site(map_path, asked)).model
    rows = {row.kind: row for row in model.sources()}
    assert (rows["Building"].count, rows["Building"].source) == (4, "extract")
    assert rows["Driving lanes"].source == "map"
    elsewhere = Extract(40.0, 5.0)
    elsewhere.house(0, 0, 10, 10)
    with pytest.raises(SeipError, match="no objects at the place"):
        finish(build_site(map_path, dataclasses.replace(asked, osm=elsewhere.write(tmp_path / "no.osm"))))


def test_latitude_and_longitude_are_places_of_a_map_with_a_projection_and_of_no_other(tmp_path):
    site = built(crossing(), tmp_path)
    assert site.map_text is not None
    map_path = opendrive(site.map_text, tmp_path)
    text = map_path.read_text(encoding="utf-8")
    asked = SiteRequest(near_latlon=(52.5, 13.4), radius=50.0)
    middle = finish(build_site(map_path, asked)).model
    assert middle.region.centroid.distance(shapely.Point(0, 0)) < 2.0
    map_path.write_text(re.sub(r"<geoReference>.*?</geoReference>", "", text, flags=re.DOTALL), encoding="utf-8")
    with pytest.raises(SeipError, match=r"map 'street' .*<geoReference>"):
        finish(build_site(map_path, asked))


def test_what_stands_on_the_carriageway_is_moved_or_cut(tmp_path):
    extract = crossing()
    extract.house(30, -8, 16, 14)
    for x, y in ((30, 1.5), (60, -2.5), (-30, 2)):
        extract.node(x, y, natural="tree", height="9")
    extract.way([(25, -9), (25, 9)], barrier="hedge")
    model = built(extract, tmp_path).model
    road = plan(model, "Driving lanes")
    for name in ("Building", "Hedge"):
        assert plan(model, name).intersection(road).area < 0.5
    for tree in [part for part in model.parts if part.name.startswith("Tree")]:
        assert road.distance(shapely.Point(tree.foot[:2])) == pytest.approx(0.2, abs=0.05)
    assert [note for note in model.notes if note.endswith((": 1", ": 3")) and "carriageway" in note]


def test_a_street_leads_through_a_building_and_the_building_above_it(tmp_path):
    extract = Extract()
    extract.way([(-200, 0), (0, 0), (200, 0)], highway="tertiary", name="Main Street")
    extract.way([(0, 0), (0, 8)], highway="residential", name="Gate Lane")
    extract.way([(0, 8), (0, 22)], highway="residential", name="Gate Lane", tunnel="building_passage", layer="-1")
    extract.way([(0, 22), (0, 200)], highway="residential", name="Gate Lane")
    extract.house(-30, 8, 60, 14)
    model = built(extract, tmp_path).model
    road = plan(model, "Driving lanes")
    pieces = [part for part in model.parts if part.name.startswith("Building")]
    assert sum(plan(model, part.name).area for part in pieces) == pytest.approx(60 * 14, rel=0.01)
    for part in pieces:
        lowest = part.solid.vertices[:, 2].min()
        assert lowest > 4 or plan(model, part.name).intersection(road).area < 0.1
    assert not any("carriageway" in note for note in model.notes)


def test_slip_lanes_leave_islands_and_the_weighted_box_lies_along_the_roads(tmp_path):
    extract = Extract()
    middle = extract.node(0, 0, highway="traffic_signals")
    usual = {"highway": "primary", "lanes": 6}
    extract.way([(-200, 0), (-50, 0), middle, (50, 0), (200, 0)], name="East Road", **usual)
    extract.way([(0, -200), (0, -50), middle, (0, 50), (0, 200)], name="North Road", **usual)
    for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
        ends = [(50 * x, 0), (26 * x, 12 * y), (12 * x, 26 * y), (0, 50 * y)]
        extract.way(ends if x * y > 0 else ends[::-1], highway="primary_link", oneway="yes")
    model = built(corner_houses(extract, near=34), tmp_path).model
    holes = [shapely.Polygon(ring) for ring in model.region.interiors]
    assert len(holes) == 4
    assert all(100 < hole.area < 300 for hole in holes)
    box = plan(model, "Junction")
    low_x, low_y, high_x, high_y = box.bounds
    assert box.area == pytest.approx((high_x - low_x) * (high_y - low_y), rel=0.1)


@pytest.mark.parametrize("radius", few([30, 60], 1))
def test_a_roundabout_is_one_place_with_all_its_approaches(radius, tmp_path):
    extract = Extract()
    ring = [extract.node(radius * np.cos(at), radius * np.sin(at)) for at in np.arange(24) * np.pi / 12]
    extract.way([*ring[:13]], highway="primary", junction="roundabout", name="Circus", lanes=2)
    extract.way([*ring[12:], ring[0]], highway="primary", junction="roundabout", name="Circus", lanes=3)
    for name, index, end in (
        ("East", 0, (300, 0)),
        ("North", 6, (0, 300)),
        ("West", 12, (-300, 0)),
        ("South", 18, (0, -300)),
    ):
        extract.way([ring[index], end], highway="primary", name=f"{name} Street")
    extract.house(-150, 40, 30, 30)
    model = built(extract, tmp_path).model
    assert model.region.geom_type == "Polygon"
    for x, y in ((radius + 75, 0), (-radius - 75, 0), (0, radius + 75), (0, -radius - 75)):
        assert model.region.distance(shapely.Point(x, y)) < 4.0
    assert plan(model, "Junction").area > (2 * radius) ** 2
    for name in ("Pavements", "Verge strip"):
        assert not plan(model, name).intersects(shapely.Point(0, 0).buffer(radius - 8))
    assert not plan(model, "Driving lanes").intersects(shapely.Point(0, 0).buffer(radius / 2))
    assert any(part.name.startswith("Building") for part in model.parts)


def test_streets_that_part_at_an_acute_angle_are_a_junction(tmp_path):
    extract = Extract()
    extract.way([(-200, 0), (0, 0), (217, 38)], highway="secondary", name="Left Fork")
    extract.way([(0, 0), (215, -46)], highway="secondary", name="Right Fork")
    extract.house(-40, 12, 20, 20)
    model = built(extract, tmp_path).model
    assert model.name == "Left Fork / Right Fork"
    assert model.region.geom_type == "Polygon"


def test_the_other_carriageway_is_whole_beside_a_junction_that_does_not_reach_it(tmp_path):
    extract = Extract()
    usual = {"highway": "primary", "oneway": "yes", "name": "Avenue"}
    extract.way([(250, 9), (60, 9)], lanes=2, **usual)
    extract.way([(60, 9), (-250, 9)], lanes=3, **usual)
    extract.way([(-250, -9), (0, -9), (250, -9)], lanes=2, **usual)
    extract.way([(0, -200), (0, -9)], highway="residential", name="Side Street")
    model = built(corner_houses(extract, near=24), tmp_path).model
    assert len(shapely.get_parts(model.region)) == 2
    for x in range(-80, 81, 5):
        assert model.region.distance(shapely.Point(x, 18)) < 5.0  # the middle is that of the other carriageway


def test_of_several_places_where_streets_meet_one_counts_and_the_others_are_named(tmp_path):
    extract = Extract()
    extract.way([(-300, 0), (-150, 0), (150, 0), (300, 0)], highway="secondary", name="East Road")
    extract.way([(-150, 0), (-150, 80), (150, 80), (150, 0)], highway="residential", name="Crescent")
    site = built(extract, tmp_path, near_latlon=None, junction=("East Road", "Crescent"))
    assert "Crescent" in site.model.name
    assert any("meet in 2 places" in note and "--near-latlon" in note for note in site.model.notes)


@pytest.mark.parametrize(
    "name",
    [
        "St John's Road",
        'The "Strand" & <Mall>',
        "\u0634\u0627\u0631\u0639 \u0627\u0644\u0645\u0644\u0643",
        "\U0001f600 Street",
    ],
)
def test_names_of_streets_are_as_in_the_extract(name, tmp_path):
    extract = Extract()
    extract.way([(-200, 0), (0, 0), (200, 0)], highway="residential", name=name)
    extract.way([(0, -200), (0, 0), (0, 200)], highway="residential", name="Second")
    model = built(extract, tmp_path, near_latlon=None, junction=(name, "Second")).model
    assert set(model.name.split(" / ")) == {name, "Second"}
    assert name in {place.name for place in model.places}


@pytest.mark.parametrize(
    ("tags", "said"),
    [
        (
            {"lanes": "1000000000"},
            "East Road lanes=1000000000, which is not a plausible number of lanes: 2 lanes in all",
        ),
        ({"lanes": "many"}, "East Road lanes=many, which"),
        ({"lanes": "4", "lanes:forward": "99"}, "East Road lanes:forward=99, which"),
    ],
)
def test_an_implausible_number_of_lanes_is_named_in_a_note(tags, said, tmp_path):
    extract = Extract()
    extract.way([(-200, 0), (0, 0), (200, 0)], highway="secondary", name="East Road", **tags)
    extract.way([(0, -200), (0, 0), (0, 200)], highway="secondary", name="North Road", lanes=2)
    notes = [note for note in built(corner_houses(extract), tmp_path).model.notes if "lanes" in note]
    (note,) = notes
    assert said in note


def test_a_bridge_without_a_layer_lies_above(tmp_path):
    extract = crossing()
    extract.way([(-300, 60), (-60, 60)], highway="primary", name="High Road")
    extract.way([(-60, 60), (60, 60)], highway="primary", name="High Road", bridge="yes")
    extract.way([(60, 60), (300, 60)], highway="primary", name="High Road")
    model = built(extract, tmp_path).model
    above = [part for part in model.parts if part.name == "Roads above"]
    assert above
    assert above[0].solid.vertices[:, 2].max() > 5


PARALLEL = {
    "a street of the same name": ([(60, 0), (66, 14), (240, 14)], "Avenue"),
    "a street that forks off": ([(60, 0), (85, 10), (110, 14), (240, 16)], "Little Row"),
    "a street along a part of it": ([(50, 0), (54, 14), (74, 14), (78, 0)], "Little Row"),
}


@pytest.mark.parametrize(("points", "name"), PARALLEL.values(), ids=PARALLEL)
def test_a_residential_street_along_an_approach_is_not_studied(tmp_path, points, name):
    extract = Extract()
    middle = extract.node(0, 0, highway="traffic_signals")
    ends = [points[0]] + [points[-1]] * (points[-1][1] == 0)
    extract.way([(-250, 0), middle, *ends, (250, 0)], highway="secondary", lanes=2, name="Avenue")
    extract.way([(0, -200), middle, (0, 200)], highway="tertiary", name="Side Street")
    extract.way(points, highway="residential", name=name)
    region = built(corner_houses(extract, near=30.0), tmp_path).model.region
    assert region.intersection(shapely.box(points[0][0] - 5, 8, 200, 30)).area < 5
    assert region.bounds[2] > 75


RINGS = {
    "secondary": (
        "-3.9,9.4 -7.9,6.3 -9.8,1.7 -9.8,-4.1 -7.2,-8 -2.7,-10.6 2.7,-10.6 6.4,-9.3 9,-5.4 9.7,0 9,5 6.4,7.6 1.9,8.9",
        {
            0: "-10.8,26.1 -30,55.6 -75,106",
            3: "-17.1,-8.3 -24.9,-14.8 -79,-104",
            6: "7.3,-40.5 9.2,-66.4 14,-101",
            10: "70.3,16.4 98.3,25.2 221,57",
        },
        {"highway": "secondary"},
    ),
    "with cycle lanes": (
        "12,-5 12,1 6,10 1,13 -3,12 -9,10 -12,5 -12,-1 -9,-6 -5,-10 0,-13 8,-10",
        {6: "-72,32 -168,77", 3: "1,32 8,86 27,237", 0: "40,-23 98,-49 206,-100", 10: "-6,-28 -13,-76"},
        {"highway": "primary", "cycleway": "track"},
    ),
    "with an acute entry": (
        "-6,9 -10,5 -11,0 -10,-6 -6,-11 0,-13 7,-11 11,-5 12,0 10,5 7,9 0,10",
        {9: "58,34 80,48 167,91", 4: "-54,-35 -120,-70", 11: "-10,19 -21,25 -31,29 -90,50"},
        {"highway": "primary", "cycleway": "lane"},
    ),
}
"""Small roundabouts: the nodes of the ring, the arms by the node where they meet it, and the tags of the arms."""


def points(text):
    return [tuple(map(float, pair.split(","))) for pair in text.split()]


@pytest.mark.parametrize("name", few(RINGS, 1))
def test_the_island_and_the_pavements_of_a_small_roundabout_are_whole(tmp_path, name):
    ring, arms, tags = points(RINGS[name][0]), *RINGS[name][1:]
    extract = Extract()
    extract.way([*ring, ring[0]], highway=tags["highway"], junction="roundabout", name="Circus")
    for index, path in arms.items():
        extract.way([ring[index], *points(path)], name=f"Arm {index}", **tags)
    model = built(extract, tmp_path).model
    road, pavement = plan(model, "Driving lanes"), plan(model, "Pavements")
    paved = shapely.union_all([road, plan(model, "Cycle lanes")])
    (island,) = [
        shapely.Polygon(hole)
        for part in shapely.get_parts(paved)
        for hole in part.interiors
        if shapely.Polygon(hole).contains(shapely.Point(0, 0))
    ]
    middle_line = shapely.Polygon(ring)
    assert 0.85 < island.area / middle_line.buffer(-1.6).area < 1.25
    assert island.convex_hull.area < 1.05 * island.area
    assert pavement.intersection(island).area == pytest.approx(0.0, abs=1e-3)
    assert plan(model, "Verge strip").intersection(island).area == pytest.approx(0.0, abs=1e-3)
    walked = shapely.set_precision(pavement, 1e-3)
    wide = walked.buffer(-0.29, join_style="mitre").buffer(0.35, join_style="mitre")
    assert walked.difference(wide).area < 0.02
    street = shapely.union_all([paved, walked]).buffer(0.06, join_style="mitre").buffer(-0.06, join_style="mitre")
    around = shapely.Point(0, 0).buffer(28)
    rounded = street.buffer(1.0, join_style="mitre").buffer(-1.0, join_style="mitre")
    assert rounded.difference(street).intersection(around).difference(island).area < 0.5
