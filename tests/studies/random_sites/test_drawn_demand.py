"""Demand in which each road user has its own size, with rows of parked cars as asked for."""

from xml.etree import ElementTree as ET

from headless.studies.random_sites.demand_draw import DrawnDemand

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.traffic.vehicle_types import read_vehicle_types
from seip_addon.core.world.traffic_simulation.demand import Demand, write_routes
from tests.builders.street_network import three_ways


def routes(folder, demand):
    path = folder / "r.rou.xml"
    write_routes(path, three_ways(folder), demand, seed=1, duration=3600.0)
    return ET.parse(path).getroot(), path.read_bytes()  # noqa: S314  # written just now


def test_own_sizes_are_drawn_for_each_road_user(tmp_path):
    root, text = routes(tmp_path, DrawnDemand(flow=1500.0))
    types = finish(read_vehicle_types([tmp_path / "r.rou.xml"]))
    moving = [entry for entry in root if entry.tag in ("vehicle", "person")]
    assert all(entry.get("type") == entry.get("id") for entry in moving)
    for entry in moving:
        category, own = entry.get("id").partition("-")[0], types[entry.get("id")]
        assert own.category in ({"car", "van"} if category == "parked" else {category})
        assert category != "parked" or own.length <= 6.0
    cars = [types[entry.get("id")] for entry in moving if entry.get("id").startswith("car")]
    assert len({(car.length, car.width, car.height) for car in cars}) > 0.9 * len(cars) > 50
    assert all(3.6 <= car.length <= 5.2 for car in cars)
    assert text == routes(tmp_path, DrawnDemand(flow=1500.0))[1]
    _, plain = routes(tmp_path, Demand(flow=1500.0))
    drives = [line.partition('depart="')[2] for line in plain.decode().splitlines() if "<vehicle " in line]
    assert drives == [line.partition('depart="')[2] for line in text.decode().splitlines() if "<vehicle " in line]
