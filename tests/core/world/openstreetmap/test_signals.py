"""Traffic signals that are mapped before the junction: they have posts at it, or a note."""

import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.workflows.site_building import SiteRequest, build_site
from seip_addon.core.world.openstreetmap.extract import read_extract, window
from seip_addon.core.world.openstreetmap.streets import write_streets
from tests.builders.osm_text import Extract, corner_houses
from tests.sumo_here import needs_sumo


def approached(away=10.0, arms=("east", "west", "north", "south"), far=200.0, **tags):
    """Return a crossing with signals some metres before it on its arms, and none at it."""
    extract = Extract()
    ends = {"east": (1, 0), "west": (-1, 0), "north": (0, 1), "south": (0, -1)}
    for name, (x, y) in ends.items():
        street = {"highway": "secondary", "lanes": 2, "name": "East Road" if y == 0 else "North Road"}
        line = [(0, 0), (far * x, far * y)]
        if name in arms:
            line.insert(1, extract.node(away * x, away * y, highway="traffic_signals", **tags))
        extract.way(line, **street)
    return corner_houses(extract)


def signal_poles(extract, tmp_path, **asked):
    path = extract.write(tmp_path / "place.osm")
    place = {"near_latlon": (extract.latitude, extract.longitude)} | asked
    model = finish(build_site(path, SiteRequest(**place))).model
    return [part for part in model.parts if "ignal pole" in part.name], model


@needs_sumo
@pytest.mark.parametrize("away", [7.0, 13.0, 28.0])
@pytest.mark.parametrize("arms", [("east", "west", "north", "south"), ("east", "south")])
def test_signals_at_the_stop_lines_have_posts_at_the_junction(tmp_path, away, arms):
    poles, model = signal_poles(approached(away, arms), tmp_path)
    assert len(poles) >= 4
    assert max(np.hypot(*part.foot[:2]) for part in poles) < 20.0
    assert not any("belong to no junction" in note for note in model.notes)


@needs_sumo
def test_signals_between_junctions_have_no_post_and_a_note(tmp_path):
    poles, model = signal_poles(approached(70.0, ("east", "west")), tmp_path)
    assert not poles
    (note,) = [note for note in model.notes if "belong to no junction" in note]
    assert note.startswith("traffic signals that belong to no junction within 40 m have no post: 2, at 52.50000, 13.4")


def written(extract, tmp_path):
    """Return whether the node at the middle, and those before it, carry signals in what netconvert reads."""
    read = finish(read_extract(extract.write(tmp_path / "place.osm")))
    target = tmp_path / "streets.osm"
    result = write_streets(read, target, window(extract.latitude, extract.longitude, 500.0))
    lines = target.read_text(encoding="utf-8").split("<node ")
    signals = [line.partition('"')[2].partition('"')[0] for line in lines if "traffic_signals" in line]
    return [int(number) for number in signals], result


@pytest.mark.parametrize(
    ("direction", "arms", "at_junction"),
    [("backward", ("east",), True), ("forward", ("east",), False), ("both", ("east",), True)],
)
def test_the_direction_of_signals_counts(tmp_path, direction, arms, at_junction):
    """The way leads away from the junction: its traffic that comes to it goes backward."""
    extract = approached(20.0, arms, traffic_signals__direction=direction)
    numbers, result = written(extract, tmp_path)
    middle = extract.node(0, 0)
    assert (numbers == [middle]) is at_junction
    assert bool(result.lone_signals) is not at_junction


@pytest.mark.parametrize(("oneway", "inwards", "at_junction"), [("yes", False, False), ("-1", False, True)])
def test_signals_control_the_traffic_of_a_one_way_street(tmp_path, oneway, inwards, at_junction):
    extract = Extract()
    line = [(0, 0), extract.node(20, 0, highway="traffic_signals"), (200, 0)]
    extract.way(line[::-1] if inwards else line, highway="secondary", oneway=oneway)
    for end in ((-200, 0), (0, 200), (0, -200)):
        extract.way([(0, 0), end], highway="secondary")
    numbers, _ = written(extract, tmp_path)
    assert (extract.node(0, 0) in numbers) is at_junction


def test_signals_that_stand_behind_a_junction_are_its(tmp_path):
    for away, number in ((10.0, 1), (30.0, 0)):
        extract = approached(away, ("east",), traffic_signals__direction="forward")
        numbers, _ = written(extract, tmp_path)
        assert numbers.count(extract.node(0, 0)) == number


ORIGIN_ROUNDING = 0.8  # metres: local origins are whole metres of the map


def streets(*, crossing=None, footway=False):
    """Return a crossing of two streets, and a node or a footway across the eastern one."""
    extract = Extract(52.5, 15.0)  # where the map's north is north
    usual = {"lanes": 2, "maxspeed": "30"}
    east = [(0, 0), (30, 0), (200, 0)]
    if crossing is not None:
        east[1] = extract.node(30, 0, **crossing)
    extract.way([(-200, 0), *east], highway="secondary", name="East Road", **usual)
    extract.way([(0, -200), (0, 0), (0, 200)], highway="secondary", name="North Road", **usual)
    if footway:
        extract.way([(30, 12), (30, 0), (30, -12)], highway="footway", footway="crossing", width="3")
    return corner_houses(extract)


def built(extract, tmp_path):
    path = extract.write(tmp_path / "place.osm")
    return finish(build_site(path, SiteRequest(near_latlon=(extract.latitude, extract.longitude))))


def crossings(site):
    return {place.name: place.polygon for place in site.model.places if place.name.startswith("Crossing")}


@needs_sumo
@pytest.mark.parametrize(
    ("how", "depth"),
    [
        ({"crossing": {"highway": "crossing"}}, 4.0),
        ({"crossing": {"highway": "crossing", "width": "6"}}, 6.0),
        ({"footway": True}, 3.0),
    ],
)
def test_the_extract_s_crossings_replace_guessed_ones(tmp_path, how, depth):
    site = built(streets(**how), tmp_path)
    ((name, area),) = crossings(site).items()
    assert name == "Crossing of East Road"
    assert area.area == pytest.approx(6.4 * depth, rel=0.03)
    assert area.centroid.distance(shapely.Point(30, 0)) < ORIGIN_ROUNDING
    x, y = np.ptp(shapely.get_coordinates(area), axis=0)
    assert (x, y) == pytest.approx((depth, 6.4), abs=0.2)
    assert not any("crossings of pedestrians" in note for note in site.model.notes)


@needs_sumo
def test_a_crossing_within_the_map_s_junction_lies_where_the_extract_has_it(tmp_path):
    extract = Extract(52.5, 15.0)
    node = extract.node(9, 0, highway="crossing")
    extract.way([(-200, 0), (0, 0), node, (200, 0)], highway="secondary", name="East Road", lanes=2)
    extract.way([(0, -200), (0, 0), (0, 200)], highway="secondary", name="North Road", lanes=4)
    ((_, area),) = crossings(built(corner_houses(extract), tmp_path)).items()
    assert area.centroid.distance(shapely.Point(9, 0)) < ORIGIN_ROUNDING
    assert area.area == pytest.approx(4 * 6.4, abs=1.0)
