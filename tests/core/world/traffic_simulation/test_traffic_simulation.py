"""Traffic simulated on a map: the demand by hand, and SUMO itself where it is installed."""

import os
import shutil
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.traffic.floating_car_data import Extent, read_floating_car_data
from seip_addon.core.sensing.traffic.vehicle_types import read_vehicle_types
from seip_addon.core.world.traffic_simulation import simulation as sumo
from seip_addon.core.world.traffic_simulation.demand import VEHICLE_SHARES, Demand, write_routes
from seip_addon.core.world.traffic_simulation.street_network import DRIVING, WALKING, read_network
from tests.builders.street_network import three_ways
from tests.sumo_here import needs_sumo

ROOT = Path(__file__).resolve().parents[4]
MAPS = Path(os.environ.get("SEIP_MAPS", ROOT.parent / "shared" / "opendrive"))


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


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda: Demand(flow=float("nan")), "--flow"),
        (lambda: Demand(turns=(0.0, 0.0, 0.0)), "--turns"),
        (lambda: Demand(pedestrians=-1.0), "--pedestrians"),
        (lambda: sumo.SignalPlan(green=0), "green"),
        (lambda: sumo.Scenario(Demand(), sumo.SignalPlan(), -1, 10.0), "--seed"),
        (lambda: sumo.Scenario(Demand(), sumo.SignalPlan(), 1, 0.0), "above 0 s"),
    ],
)
def test_senseless_demand_is_refused(make, complaint):
    with pytest.raises(SeipError, match=complaint):
        make()


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
def test_the_same_seed_gives_the_same_traffic_in_folders_of_any_name(tmp_path, run):
    own = tmp_path / "Leeds, UK" / "A: junction, 2.xodr"
    own.parent.mkdir()
    shutil.copyfile(JUNCTION, own)
    one, same = run, simulated(tmp_path / "same: 1, 2", own)
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
    types = finish(read_vehicle_types(files.routes))
    read = finish(read_floating_car_data(files.path, types, np.zeros(3), "Town05", window=Extent(begin=20.0)))
    assert len(read.trajectories) > 20
    assert not read.warnings
