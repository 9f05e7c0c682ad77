"""Demand of a user's route file, drawn randomly."""

from collections import Counter
from xml.etree import ElementTree as ET

from headless.studies.paper.route_file import read_demand, write_run

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.traffic.vehicle_types import read_vehicle_types

TYPES = """<routes>
 <vType id="small" length="3.6" width="1.6" height="1.5" vClass="passenger"/>
 <vType id="large" length="5.1" width="1.9" height="1.6" minGap="2" guiShape="passenger &amp; more"/>
 <vType id="bike" length="1.6" width="0.6" height="1.7" vClass="bicycle"/>
</routes>"""
ROUTES = """<routes>
 <vType id="own" vClass="truck" length="8" width="2.4" height="3"/>
 <route id="WE" edges="w e"/>
 <flow id="we" vehsPerHour="600" route="WE" departSpeed="5"/>
 <flow id="wn" period="12" type="own" departLane="best"><route edges="w n"/></flow>
 <flow id="ws" period="exp(0.025)" route="WS"/>
 <flow id="sn" probability="0.05"><route edges="s n"/></flow>
 <route id="WS" edges="w s"/>
</routes>"""
RATES = {"w e": 600.0, "w n": 300.0, "w s": 90.0, "s n": 180.0}


def demand(folder, routes=ROUTES, types=(TYPES,)):
    path = folder / "a.rou.xml"
    path.write_text(routes, encoding="utf-8")
    files = []
    for number, text in enumerate(types):
        files.append(folder / f"types{number}.xml")
        files[-1].write_text(text, encoding="utf-8")
    return finish(read_demand(path, files))


def written(folder, asked, seed=1, duration=36000.0):
    path = folder / "run.rou.xml"
    write_run(path, asked, seed, duration)
    return ET.parse(path).getroot().findall("vehicle"), path  # noqa: S314  # written just now


def test_routes_come_at_their_rates_and_departures_are_a_poisson_process(tmp_path):
    vehicles, path = written(tmp_path, demand(tmp_path))
    counts = Counter(vehicle.find("route").get("edges") for vehicle in vehicles)
    for edges, rate in RATES.items():
        assert counts[edges] == pytest.approx(10 * rate, abs=4 * (10 * rate) ** 0.5)
    departs = np.array([float(vehicle.get("depart")) for vehicle in vehicles])
    gaps = np.diff(departs)
    assert (gaps >= 0).all()
    assert gaps.std() == pytest.approx(gaps.mean(), rel=0.05)  # as of an exponential distribution
    kinds = finish(read_vehicle_types([path]))
    lengths = Counter(
        (kinds[vehicle.get("type")].length, kinds[vehicle.get("type")].category, vehicle.find("route").get("edges"))
        for vehicle in vehicles
    )
    assert {key for key in lengths if key[2] == "w n"} == {(8.0, "truck", "w n")}
    assert {key[:2] for key in lengths if key[2] != "w n"} == {(3.6, "car"), (5.1, "car")}  # no bicycle by itself
    assert lengths[3.6, "car", "w e"] == pytest.approx(3000, abs=200)
    lanes = {vehicle.find("route").get("edges"): vehicle.get("departLane") for vehicle in vehicles}
    assert lanes == {"w e": "random", "w n": "best", "w s": "random", "s n": "random"}
    assert {vehicle.get("departSpeed") for vehicle in vehicles if "we" in vehicle.get("id")} == {"5"}


def test_each_seed_is_another_run_and_the_same_seed_the_same_bytes(tmp_path):
    asked = demand(tmp_path)
    texts = [written(tmp_path, asked, seed, 600.0)[1].read_bytes() for seed in (1, 1, 2)]
    assert texts[0] == texts[1] != texts[2]
    names = [{vehicle.get("id") for vehicle in written(tmp_path, asked, seed, 600.0)[0]} for seed in (1, 2)]
    assert not names[0] & names[1]


FLOW = '<routes><route id="r" edges="w e"/><flow id="a" {}/></routes>'


@pytest.mark.parametrize(
    ("routes", "message"),
    [
        ('<routes><vehicle id="a"/></routes>', "a.rou.xml has no flow: name a route file"),
        (FLOW.format('vehsPerHour="60" route="x"'), "flow 'a' has no route of edges in this file"),
        (FLOW.format('vehsPerHour="60" from="w" to="e"'), "flow 'a' has no route of edges"),
        (FLOW.format('route="r"'), "flow 'a' has no rate above 0"),
        (FLOW.format('route="r" vehsPerHour="-5"'), "flow 'a' has no rate above 0"),
        (FLOW.format('route="r" period="0"'), "flow 'a' has no rate above 0"),
        (FLOW.format('route="r" period="exp(x)"'), "flow 'a' has no rate above 0"),
        (FLOW.format('route="r" number="7"'), "flow 'a' has no rate above 0"),
        (FLOW.format('route="r" vehsPerHour="60" type="tank"'), "flow 'a' is of type 'tank', which no file describes"),
        (FLOW.format('route="r" vehsPerHour="60" begin="900"'), "flow 'a' does not begin at 0"),
        ("<routes><flow", "a.rou.xml is broken or unfinished XML"),
    ],
)
def test_a_demand_that_cannot_be_drawn_is_one_sentence(tmp_path, routes, message):
    with pytest.raises(SeipError, match=message):
        demand(tmp_path, routes)
