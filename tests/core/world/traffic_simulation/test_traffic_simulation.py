"""Traffic simulated on a map: the demand by hand, and SUMO itself where it is installed."""

import os
from collections import Counter
from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from seip_addon.core import sumo_programs
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
from seip_addon.core.sensing.traffic.floating_car_data import Extent, read_floating_car_data, read_trajectories
from seip_addon.core.sensing.traffic.trajectories import CATEGORIES
from seip_addon.core.sensing.traffic.vehicle_types import read_vehicle_types
from seip_addon.core.sumo_programs import find_sumo
from seip_addon.core.workflows.site_building import SiteRequest, build_site, save_map
from seip_addon.core.world.traffic_simulation import simulation as sumo
from seip_addon.core.world.traffic_simulation.demand import MODELS, VEHICLE_SHARES, Demand, write_routes
from seip_addon.core.world.traffic_simulation.street_network import DRIVING, PARKING, WALKING, read_network
from tests.builders.street_network import BAYS, ROAD, edge, network, three_ways, way
from tests.sumo_here import needs_sumo

ROOT = Path(__file__).resolve().parents[4]
MAPS = Path(os.environ.get("SEIP_MAPS", ROOT.parent / "shared" / "opendrive"))


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (edge("a", "n", ROAD, length=-7), r"n\.net\.xml .* <lane> 'a_0': the length is -7, not 0"),
        (edge("a", "n", ROAD, length="nan"), "length is nan"),
        (edge("a", "n", ROAD).replace('shape="0,0 120,0"', 'shape="0,0 nan,0"'), "a coordinate is nan"),
        (edge("a", "n", ROAD).replace('shape="0,0 120,0"', 'shape="0,0 1e300,0"'), r"a coordinate is 1e\+300"),
        (edge("a", "n", ROAD).replace('shape="0,0 120,0"', 'shape="0,0"'), "not a line of two or more points"),
        (edge("a", "n", ROAD).replace('index="0"', 'index="-1"'), "the index is -1"),
        (edge("a", "n", ROAD).replace(' to="n"', ""), "<edge> 'a': the attribute 'to' is missing"),
        (
            edge("a", "n", ROAD) + way("a", "b", "s", lane=4),
            "<connection> from 'a' to 'b': fromLane is 4, but the edge has 1 lane",
        ),
        ('<junction id="n" type="traffic_light" x="inf" y="0"/>', "<junction> 'n': a coordinate is inf"),
        ("", "has no edges"),
    ],
)
def test_a_network_with_impossible_figures_is_refused(tmp_path, text, complaint):
    with pytest.raises(SeipError, match=complaint):
        network(tmp_path, text)


def routes(folder, streets, seed=1, duration=3600.0, **demand):
    path = folder / "r.rou.xml"
    write_routes(path, streets, Demand(**demand), seed, duration)
    return ET.parse(path).getroot(), path.read_bytes()  # noqa: S314  # written just now


def test_a_network_by_hand(tmp_path):
    streets = three_ways(tmp_path)
    assert list(streets.edges) == ["in", "left", "on", "right"]
    assert [lane.use for lane in streets.edges["on"].lanes] == [WALKING, DRIVING, DRIVING]
    assert streets.turns == {"in": [("left", "l"), ("on", "s"), ("right", "r")]}
    assert [arm.id for arm in streets.arms] == ["in"]
    np.testing.assert_array_equal(streets.signalised["j"], [3.0, 4.0])


def test_where_people_cross_is_no_way_for_vehicles(tmp_path):
    """Where a street has no pavement people walk on its lane, which leads to where they cross."""
    streets = network(
        tmp_path,
        edge("in", "j", 'allow=""'),
        edge("on", "out", ROAD),
        '<junction id="out" type="dead_end" x="0" y="0"/>',
        way("in", ":j_w5", "s"),
        way("in", "on", "s"),
    )
    assert streets.turns == {"in": [("on", "s")]}
    routes(tmp_path, streets, pedestrians=0.0)


def test_flow_turns_and_mix_are_as_asked_for(tmp_path):
    root, _ = routes(tmp_path, three_ways(tmp_path), flow=2000.0, turns=(0.1, 0.6, 0.3), duration=7200.0)
    driving = [vehicle for vehicle in root.iter("vehicle") if not vehicle.get("id").startswith("parked")]
    assert len(driving) == pytest.approx(4000, rel=0.06)
    turned = Counter(vehicle.find("route").get("edges").split()[1] for vehicle in driving)
    for name, share in (("left", 0.1), ("on", 0.6), ("right", 0.3)):
        assert turned[name] / len(driving) == pytest.approx(share, abs=0.03)
    categories = Counter(vehicle.get("id").partition("-")[0] for vehicle in driving)
    for category, share in VEHICLE_SHARES.items():
        assert categories[category] / len(driving) == pytest.approx(share / sum(VEHICLE_SHARES.values()), abs=0.03)
    departs = [float(entry.get("depart")) for entry in root if entry.get("depart")]
    assert departs == sorted(departs)
    assert departs[-1] < 7200.0


def test_the_same_seed_gives_the_same_bytes(tmp_path):
    streets = three_ways(tmp_path)
    assert routes(tmp_path, streets, seed=4)[1] == routes(tmp_path, streets, seed=4)[1]
    assert routes(tmp_path, streets, seed=4)[1] != routes(tmp_path, streets, seed=5)[1]


def bays(root):
    """Return lane and middle of each parked car."""
    models = {f"parked_{name}": model for group in MODELS.values() for name, model in group.items()}
    return [
        (
            vehicle.find("stop").get("lane"),
            float(vehicle.find("stop").get("endPos")) - models[vehicle.get("type")].length / 2,
        )
        for vehicle in root.iter("vehicle")
        if vehicle.get("id").startswith("parked")
    ]


@pytest.mark.parametrize("kerb", ["rows", "lanes"])
def test_each_seed_parks_other_cars_in_other_places(tmp_path, kerb):
    streets = three_ways(tmp_path)
    if kerb == "lanes":
        streets = network(
            tmp_path, edge("in", "j", ROAD), edge("out", "end", BAYS, ROAD, length=200), way("in", "out", "s")
        )
    drawn = [routes(tmp_path, streets, seed=seed, duration=600.0)[0] for seed in range(1, 5)]
    for one, other in combinations(map(bays, drawn), 2):
        assert one
        assert min(abs(a - b) for lane, a in one for there, b in other if lane == there or kerb == "lanes") > 1.0
    names = [{entry.get("id") for entry in root if entry.tag in {"vehicle", "person"}} for root in drawn]
    assert not any(one & other for one, other in combinations(names, 2))  # and so no paint is, which goes by the name
    departures = [tuple(entry.get("depart") for entry in root if entry.tag in {"vehicle", "person"}) for root in drawn]
    types = [tuple(vehicle.get("type") for vehicle in root.iter("vehicle")) for root in drawn]
    assert len(set(departures)) == len(set(types)) == 4


def test_every_model_is_read_back_as_its_category_and_size(tmp_path):
    routes(tmp_path, three_ways(tmp_path))
    types = finish(read_vehicle_types([tmp_path / "r.rou.xml"]))
    assert tuple(MODELS) == CATEGORIES
    for category, models in MODELS.items():
        for name, model in models.items():
            read = types[name]
            assert (read.category, read.length, read.width, read.height) == (category, *model[2:5])
    assert types["parked_compact"].category == "car"


def test_rows_of_parked_cars_leave_a_lane_and_deliveries_keep_clear(tmp_path):
    root, _ = routes(tmp_path, three_ways(tmp_path), flow=3000.0)
    stops = {vehicle.get("id"): vehicle.find("stop") for vehicle in root.iter("vehicle")}
    parked = {stop.get("lane") for name, stop in stops.items() if name.startswith("parked")}
    others = [stop.get("lane") for name, stop in stops.items() if stop is not None and not name.startswith("parked")]
    assert len(parked) == 2  # of three streets that lead out
    assert all(lane.endswith("_1") for lane in parked)  # the outer driving lane, beside the pavement
    assert others
    assert not parked & set(others)
    assert not any(lane.startswith("in") for lane in others)  # it has one lane: nobody could pass


@pytest.mark.parametrize("shares", [{"tram": 1.0}, {"car": 0.0}, {"car": 1.0, "bus": -0.1}, {}])
def test_no_mix_of_vehicles_is_one_sentence(shares):
    with pytest.raises(SeipError, match="shares of vehicles must be for car, van"):
        Demand(shares=shares)


def test_parking_lanes_are_used_where_there_are_any(tmp_path):
    streets = network(
        tmp_path,
        edge("in", "j", ROAD),
        edge("out", "end", BAYS, ROAD, ROAD, length=200),
        way("in", "out", "s"),
    )
    assert len(streets.edges["out"].lanes_for(PARKING)) == 1
    root, _ = routes(tmp_path, streets)
    lanes = [vehicle.find("stop").get("lane") for vehicle in root.iter("vehicle") if "parked" in vehicle.get("id")]
    assert set(lanes) == {"out_0"}
    assert 10 <= len(lanes) <= 25


def test_a_map_without_ways_in_is_refused(tmp_path):
    ring = network(tmp_path, edge("a", "x", ROAD), edge("b", "y", ROAD), way("a", "b", "s"), way("b", "a", "s"))
    with pytest.raises(SeipError, match="no road leads into the map"):
        routes(tmp_path, ring)


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda: Demand(flow=0.0), "--flow"),
        (lambda: Demand(flow=float("nan")), "--flow"),
        (lambda: Demand(turns=(0.0, 0.0, 0.0)), "--turns"),
        (lambda: Demand(turns=(-1.0, 1.0, 1.0)), "--turns"),
        (lambda: Demand(pedestrians=-1.0), "--pedestrians"),
        (lambda: sumo.SignalPlan(green=0), "green"),
        (lambda: sumo.Scenario(Demand(), sumo.SignalPlan(), -1, 10.0), "--seed"),
        (lambda: sumo.Scenario(Demand(), sumo.SignalPlan(), 1, 0.0), "above 0 s"),
    ],
)
def test_senseless_demand_is_refused(make, complaint):
    with pytest.raises(SeipError, match=complaint):
        make()


def test_without_sumo_the_cure_is_named(monkeypatch):
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("SUMO_HOME", raising=False)
    monkeypatch.setattr(sumo_programs.importlib.util, "find_spec", lambda _name: None)
    with pytest.raises(SeipError, match=r"SUMO is not installed, which .* `pip install --group traffic`"):
        find_sumo()


JUNCTION = ROOT / "scenes" / "junction.xodr"


def simulated(folder, map_path, seed=3, duration=30.0, bounds=None):
    folder.mkdir()
    scenario = sumo.Scenario(Demand(flow=500.0), sumo.SignalPlan(), seed, duration)
    return finish(sumo.simulate(map_path, folder, scenario, bounds))


def rows(path):
    """The floating car data without SUMO's comment, which holds the date."""
    return path.read_bytes().rpartition(b"-->")[2]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return simulated(tmp_path_factory.mktemp("runs") / "run", JUNCTION)


@needs_sumo
def test_the_same_seed_gives_the_same_traffic(tmp_path, run):
    one, same = run, simulated(tmp_path / "same", JUNCTION)
    other = simulated(tmp_path / "other", JUNCTION, seed=4)
    assert rows(one.path) == rows(same.path)
    assert rows(one.path) != rows(other.path)


@needs_sumo
@pytest.mark.parametrize("kind", ["tram", "curb", "shared", "walking"])
def test_no_car_drives_on_lanes_that_are_not_for_cars(tmp_path, kind):
    """SUMO leaves lanes of kinds that it does not know open to all: cars were sent where people cross."""
    path = tmp_path / "junction.xodr"
    pavements = JUNCTION.read_text(encoding="utf-8").split('type="sidewalk"')
    mixed = [text + f'type="{(kind, "sidewalk")[place % 2]}"' for place, text in enumerate(pavements[:-1])]
    path.write_text("".join([*mixed, pavements[-1]]), encoding="utf-8")
    files = simulated(tmp_path / "run", path, duration=5.0)
    streets = read_network(files.net)
    plain = read_network(simulated(tmp_path / "plain", JUNCTION, duration=5.0).net)
    driven = [{name: len(edge.lanes_for(DRIVING)) for name, edge in one.edges.items()} for one in (streets, plain)]
    assert driven[0] == driven[1]
    assert {edge for ways in streets.turns.values() for edge, _ in ways} <= streets.edges.keys()


@needs_sumo
def test_sumo_s_csv_says_what_its_xml_says(tmp_path, run):
    arguments = ["--net-file", run.net, "--route-files", *run.routes, "--end", 30, "--step-length", 0.1]
    forms = {}
    for name in ("f.xml", "f.csv", "f.xml.gz"):
        more = ["--fcd-output", tmp_path / name, "--precision", 3, "--no-warnings", "true", "--no-step-log", "true"]
        finish(sumo_programs.run(find_sumo(), find_sumo().sumo, [*arguments, *more], "again"))
        forms[name] = finish(read_floating_car_data(tmp_path / name))
    plain = forms.pop("f.xml")
    assert plain.person.any()
    for data in forms.values():
        assert (sorted(data.names), data.types.count("adult")) == (sorted(plain.names), plain.types.count("adult"))
        for name in plain.names:
            one, other = plain.names.index(name), data.names.index(name)
            assert plain.person[one] == data.person[other]
            a, b = slice(*plain.first[one : one + 2]), slice(*data.first[other : other + 2])
            np.testing.assert_array_equal(plain.position[a, :2], data.position[b, :2])
            np.testing.assert_array_equal(plain.yaw[a], data.yaw[b])


@needs_sumo
def test_crossings_lie_on_the_painted_crosswalks_and_vehicles_stop_before_them(run):
    root = ET.parse(run.net).getroot()  # noqa: S314  # written just now
    crossings = [lane.get("shape") for edge in root.iter("edge") if edge.get("function") == "crossing" for lane in edge]
    assert len(crossings) == 4
    middles = np.array(
        [np.array([c.split(",")[:2] for c in shape.split()], dtype=float).mean(axis=0) for shape in crossings]
    )
    distance = np.hypot(*middles.T)
    np.testing.assert_allclose(distance, 15.0 + 3.0, atol=0.1)  # arms begin at 15 m, crosswalks lie 1 to 5 m along
    streets = read_network(run.net)
    ends = [np.hypot(*edge.lanes_for(DRIVING)[-1].line[-1]) for edge in streets.arms]
    assert len(ends) == 4
    assert min(ends) == pytest.approx(20.0, abs=0.3)


@pytest.mark.slow
@needs_sumo
def test_town05_is_cut_to_the_scene(tmp_path):
    path = MAPS / "Town05.xodr"
    if not path.is_file():
        pytest.skip(f"no {path}")
    files = simulated(tmp_path / "town", path, duration=40.0, bounds=(-129.0, -81.0, 31.0, 79.0))
    streets = read_network(files.net)
    assert 10 <= len(streets.edges) <= 60
    assert len(streets.arms) >= 4
    data = finish(read_floating_car_data(files.path, window=Extent(begin=20.0)))
    types = finish(read_vehicle_types(files.routes))
    trajectories, warnings = read_trajectories(data, types, np.zeros(3), "Town05")
    assert len(trajectories) > 20
    assert not warnings


@pytest.mark.slow
@needs_sumo
def test_cut_behind_traffic_lights_of_a_one_way_carriageway(tmp_path):
    """The site ends a metre behind a node with traffic lights, all of whose ways on are cut off."""
    extract = MAPS.parent / "osm" / "northgate_dual_carriageway.osm"
    if not extract.is_file():
        pytest.skip(f"no {extract}")
    built = finish(build_site(extract, SiteRequest(near_latlon=(47.7086575, -122.3273312), approaches=40.0)))
    save_map(built, tmp_path / "site.xodr")
    files = simulated(tmp_path / "run", tmp_path / "site.xodr", duration=10.0, bounds=(13.4, 153.5, 187.5, 257.4))
    assert len(read_network(files.net).arms) >= 3


@needs_sumo
def test_what_sumo_refuses_is_said_in_one_sentence(tmp_path):
    programs = find_sumo()
    with pytest.raises(SeipError, match=r"sumo failed: .*nowhere.*; check the map") as caught:
        finish(sumo_programs.run(programs, programs.sumo, ["--net-file", tmp_path / "nowhere.net.xml"], "x"))
    assert "\n" not in str(caught.value)
