"""Bridges and underpasses of extracts: their height, the grade of their ramps, and what has no room for them."""

import math

import numpy as np
import pytest
import shapely

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.geometry.plan import surface_height
from seip_addon.core.site.scene_geometry import OTHER_LEVELS
from seip_addon.core.workflows.site_building import SiteRequest, build_site
from seip_addon.core.world.openstreetmap.network_map import read_network_map
from tests.builders.dem_files import origin_at, sampled, write_dem
from tests.builders.osm_text import Extract
from tests.sumo_here import needs_sumo

pytestmark = needs_sumo
ROAD_CLEARANCE, RAIL_CLEARANCE, PATH_CLEARANCE = 5.5, 6.5, 3.5  # metres between the surfaces of both
STEEPEST, GAP = 0.085, 0.02  # of ramps (8 %, and rounding), and metres between connected lanes
STEP, ROUNDING = 0.5, 2e-3  # metres along a road between which its grade is measured, and of heights in the file
MID = (52.5, 13.4)
X, Y, _ = origin_at(*MID)


def built(extract, tmp_path, **asked):
    path = extract.write(tmp_path / "place.osm")
    asked = {"near_latlon": (extract.latitude, extract.longitude), "radius": 90.0} | asked
    site = finish(build_site(path, SiteRequest(**asked)))
    (tmp_path / "place.net.xml").write_text(site.map_text, encoding="utf-8")
    return site, read_network_map(tmp_path / "place.net.xml").streets


def lanes_of(streets, name=None):
    roads = {road.id for road in streets.road_map.roads if name is None or road.name == name}
    return [lane for lane in streets.lanes if lane.lane_type == "driving" and lane.road_id in roads]


def grades(lane):
    """Return the steepest grade along the middle of a lane, over at least 2 m."""
    middle = (lane.left + lane.right) / 2
    away = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(middle[:, :2], axis=0).T))])
    along = np.linspace(0.0, away[-1], int(away[-1] / 2.0) + 1)
    return np.abs(np.diff(np.interp(along, away, middle[:, 2]))).max() / along[1] if away[-1] > 2.0 else 0.0


def gaps(streets):
    """Return the differences in height between the ends of lanes that lead into each other, by plan alone."""
    lanes = {
        road.id: [lane for lane in lanes_of(streets) if lane.road_id == road.id] for road in streets.road_map.roads
    }
    found = [0.0]
    for road in streets.road_map.roads:
        for link, row in ((road.predecessor, 0), (road.successor, -1)):
            if link is None or link.kind != "road":
                continue
            other_row = -1 if link.contact == "end" else 0
            for lane in lanes[road.id]:
                for other in lanes[link.id]:
                    one, two = ((each.left[at] + each.right[at]) / 2 for each, at in ((lane, row), (other, other_row)))
                    if np.hypot(*(one - two)[:2]) < 0.3:
                        found.append(abs(one[2] - two[2]))
    return found


def clearances(streets, upper, lower):
    """Return the differences in height of two streets where they lie above each other."""
    found = []
    for one in lanes_of(streets, upper):
        for other in lanes_of(streets, lower):
            common = one.polygon.intersection(other.polygon)
            if common.area > 0.5:
                place = shapely.get_coordinates(common.centroid)[0]
                found.append(height_at(one, place) - height_at(other, place))
    return found


def height_at(lane, place):
    middle = (lane.left + lane.right) / 2
    path = shapely.LineString(middle[:, :2])
    away = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(middle[:, :2], axis=0).T))])
    return float(np.interp(path.project(shapely.Point(place)), away, middle[:, 2]))


def bridge(extract, half=15.0, reach=300.0, angle=0.0, **tags):
    """Add High Road in three ways, the middle one on a bridge, at an angle from east (radians)."""
    tags = {"highway": "primary", "name": "High Road", "lanes": 2} | tags

    def at(away):
        return round(away * math.cos(angle), 3), round(away * math.sin(angle), 3)

    extract.way([at(-reach), at(-half)], **tags)
    extract.way([at(-half), at(half)], bridge="yes", layer="1", **tags)
    extract.way([at(half), at(reach)], **tags)


def trunk(extract, **tags):
    extract.way([(0, -300), (0, -200), (0, 200), (0, 300)], **({"highway": "trunk", "name": "Trunk Road"} | tags))


def check(streets, most=STEEPEST):
    roads = [road for road in streets.road_map.roads if not road.junction_id and road.length > STEP]
    heights = [road.elevation(np.arange(0.0, road.length, STEP)) for road in roads]
    assert max(np.abs(np.diff(one)).max() for one in heights) < most * STEP + ROUNDING
    assert max(map(grades, lanes_of(streets))) < 0.12  # inside a bend a lane is shorter than the road
    assert max(gaps(streets)) < GAP


def test_slip_roads_of_an_exit_climb_to_the_bridge(tmp_path):
    extract = Extract()
    for x, ends in ((-8, (300, -300)), (8, (-300, 300))):
        side = -1 if x < 0 else 1
        extract.way(
            [(x, ends[0]), (x, side * -180), (x, side * 180), (x, ends[1])], highway="motorway", name="A 1", lanes=2
        )
        extract.way([(x, side * -180), (3 * x, side * -90), (60 * side, 0)], highway="motorway_link")
        extract.way([(60 * side, 0), (3 * x, side * 90), (x, side * 180)], highway="motorway_link")
    tags = {"highway": "secondary", "name": "Cross Road", "lanes": 2}
    extract.way([(-300, 0), (-60, 0), (-18, 0)], **tags)
    extract.way([(-18, 0), (18, 0)], bridge="yes", layer="1", **tags)
    extract.way([(18, 0), (60, 0), (300, 0)], **tags)
    site, streets = built(extract, tmp_path, level=("Cross Road",))
    check(streets)
    assert min(clearances(streets, "Cross Road", "A 1")) > ROAD_CLEARANCE - 0.05
    assert max(abs(lane.left[:, 2]).max() for lane in lanes_of(streets, "A 1")) < 0.5
    assert not any("flat" in note for note in site.model.notes)


def test_an_underpass_is_lowered_under_a_street_that_stays(tmp_path):
    extract = Extract()
    extract.way([(-300, 0), (300, 0)], highway="primary", name="High Road", lanes=2)
    usual = {"highway": "secondary", "name": "Low Road", "lanes": 2}
    extract.way([(0, -300), (0, -30)], **usual)
    extract.way([(0, -30), (0, 30)], layer="-1", **usual)
    extract.way([(0, 30), (0, 300)], **usual)
    _, streets = built(extract, tmp_path, level=("High Road",))
    check(streets, most=0.065)
    assert min(clearances(streets, "High Road", "Low Road")) > ROAD_CLEARANCE - 0.05
    assert max(abs(lane.left[:, 2]).max() for lane in lanes_of(streets, "High Road")) < 0.01


def test_a_footbridge_does_not_move_the_street_below(tmp_path):
    extract = Extract()
    for line, layer in (((-300, -30), {}), ((-30, 30), {"layer": "-1"}), ((30, 300), {})):
        extract.way([(x, 0) for x in line], highway="primary", name="High Road", **layer)
    extract.way([(0, -40), (0, 40)], highway="footway", bridge="yes", layer="1")
    extract.way([(200, 0), (200, 100)], highway="residential", name="Side Street")
    _, streets = built(extract, tmp_path)
    assert max(abs(lane.left[:, 2]).max() for lane in lanes_of(streets)) < 0.01


def test_three_levels_lie_above_each_other(tmp_path):
    extract = Extract()
    bridge(extract, 25.0)
    trunk(extract)
    usual = {"highway": "motorway", "name": "Top Road", "lanes": 2}
    extract.way([(-280, -280), (-60, -60)], **usual)
    extract.way([(-60, -60), (60, 60)], bridge="yes", layer="2", **usual)
    extract.way([(60, 60), (280, 280)], **usual)
    _, streets = built(extract, tmp_path, level=("Trunk Road",))
    check(streets)
    for upper, lower in (("High Road", "Trunk Road"), ("Top Road", "High Road")):
        assert min(clearances(streets, upper, lower)) > ROAD_CLEARANCE - 0.05


def embankment(x, y):
    """Return ground 6 m high but for a cutting 30 m wide in which Trunk Road lies."""
    return 40.0 + np.where(np.abs(x - X) < 15.0, 0.0, 6.0) + 0.0 * y


def test_on_terrain_a_bridge_leads_from_bank_to_bank(tmp_path):
    extract = Extract()
    bridge(extract, 15.0)
    trunk(extract)
    heights = sampled(embankment, X - 420, Y + 420, 840)
    dem = write_dem(tmp_path / "dem.tif", heights, X - 420, Y + 420)
    site, streets = built(extract, tmp_path, level=("High Road",), terrain=dem)
    deck = [lane for lane in lanes_of(streets, "High Road") if abs(lane.left[:, 0].mean() - 300) < 20]
    assert min(lane.left[:, 2].min() for lane in deck) > 45.0
    assert max(lane.left[:, 2].max() for lane in lanes_of(streets)) < 47.0
    assert min(clearances(streets, "High Road", "Trunk Road")) > ROAD_CLEARANCE - 0.05
    check(streets, most=0.11)
    road = next(part for part in site.model.parts if part.name == "Driving lanes").solid.vertices[:, 2]
    assert road.min() + site.model.origin[2] > 44.9


def test_a_place_on_two_levels_is_asked_for_by_street(tmp_path):
    extract = Extract()
    bridge(extract)
    trunk(extract)
    with pytest.raises(SeipError, match=r"High Road lies 5\.\d m above Trunk Road .*level 'High Road' or level 'Trunk"):
        built(extract, tmp_path)
    for name, z in (("high road", 5.5), ("Trunk Road", 0.0)):
        site, _ = built(extract, tmp_path, level=(name,))
        road = next(part for part in site.model.parts if part.name == "Driving lanes").solid.vertices[:, 2]
        assert road.max() + site.model.origin[2] == pytest.approx(z, abs=0.05)
    with pytest.raises(SeipError, match=r"no road 'Low Road' at this place: name a street .*: High Road, Trunk Road"):
        built(extract, tmp_path, level=("Low Road",))


def random_exit(seed):
    """Return a random crossing of two roads on two levels, with a junction, side streets and slip roads."""
    random = np.random.default_rng(seed)
    extract, angle = Extract(), random.uniform(-0.7, 0.7)
    along = np.array([math.cos(angle), math.sin(angle)])
    half, west, east, junction = random.uniform([1, 120, 160, 100], [15, 350, 350, 220])
    half += 14.0 / math.cos(angle)  # both carriageways of one cross both of the other on the bridge
    dual, wide = random.random(2) < 0.5
    tags = {
        "highway": str(random.choice(["primary", "secondary", "residential"])),
        "name": "High Road",
        "lanes": int(random.integers(1, 5)),
        **({"oneway": "yes"} if dual else {}),
    }

    def at(away, aside=0.0):
        x, y = away * along + aside * np.array([-along[1], along[0]])
        return round(float(x), 2), round(float(y), 2)

    for aside, sign in ((-6.0, 1), (6.0, -1)) if dual else ((0.0, 1),):
        for line, more in (
            ((-west, -half), {}),
            ((-half, half), {"bridge": "yes", "layer": "1"}),
            ((half, 60, east), {}),
        ):
            extract.way([at(away, aside) for away in line[::sign]], **tags, **more)
    near, far = at(60, -6.0 if dual else 0.0), at(60, 6.0)
    if dual:
        extract.way([far, near], highway="residential", name="Side Street")
    extract.way([near, (near[0] + 5, near[1] - random.uniform(60, 150))], highway="residential", name="Side Street")
    for x, sign in ((-8, -1), (8, 1)) if wide else ((0, 1),):
        line = [(x, -300), (x, -round(junction, 1)), (x, round(junction, 1)), (x, 300)][::sign]
        extract.way(line, highway="trunk", name="Trunk Road", lanes=2, **({"oneway": "yes"} if wide else {}))
    x = 8 if wide else 0
    if random.random() < 0.7:
        extract.way([(x, -round(junction, 1)), (x + 12, 40 - junction), near], highway="trunk_link", oneway="yes")
    return extract


def check_exit(seed, tmp_path):
    site, streets = built(random_exit(seed), tmp_path, level=("Trunk Road",))
    assert not any("flat" in note for note in site.model.notes)
    check(streets)
    assert min(clearances(streets, "High Road", "Trunk Road")) > ROAD_CLEARANCE - 0.05
    assert not any("steeper" in warning or "differ in height" in warning for warning in site.model.warnings)


@pytest.mark.parametrize(
    "seed",
    [
        0,
        *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 5)),
        *(pytest.param(seed, marks=pytest.mark.long) for seed in range(5, 66)),
    ],
)
def test_random_exits_have_gentle_grades_and_no_steps(tmp_path, seed):
    check_exit(seed, tmp_path)


def surfaces(model, *names):
    """Return the triangles (n, 3, 3), local axes, of the parts with names."""
    corners = [
        part.solid.vertices[list(face)] for part in model.parts if part.name in names for face in part.solid.faces
    ]
    return np.array(corners).reshape(-1, 3, 3)


def test_the_ground_beside_and_below_a_bridge_is_closed(tmp_path):
    """Under the deck there is ground or the lower road; beside it the surface has no holes and no cliffs."""
    extract = Extract()
    bridge(extract)
    trunk(extract)
    site, _ = built(extract, tmp_path, level=("High Road",))
    model = site.model
    lower = surfaces(model, "Verge", OTHER_LEVELS)
    trunk_at = shapely.union_all([shapely.Polygon(face) for face in faces_in_plan(model, OTHER_LEVELS)]).centroid
    x, y = np.meshgrid(np.arange(-14.0, 14.1, 0.7), np.arange(-12.0, 12.1, 0.7))
    places = np.column_stack([x.ravel() + trunk_at.x, y.ravel() + trunk_at.y]) + 0.013
    below = surface_height(places, lower)
    assert np.isfinite(below).all()
    rows = below.reshape(x.shape)
    assert max(np.abs(np.diff(rows, axis=axis)).max() for axis in (0, 1)) < 1.6
    deck = surface_height(places, surfaces(model, "Driving lanes"))
    over = np.isfinite(deck) & (np.abs(places[:, 0] - trunk_at.x) < 3.0)
    assert over.any()
    assert (deck - below)[over].min() > ROAD_CLEARANCE - 0.1


def faces_in_plan(model, name):
    part = next(part for part in model.parts if part.name == name)
    return [part.solid.vertices[list(face), :2] for face in part.solid.faces]
