"""Weights of sites from flows of SUMO: a network by hand, a simulation, and files that are not what they should be."""

import math
import subprocess
from pathlib import Path

import numpy as np
import pytest
from defusedxml import ElementTree

from seip_addon.core.errors import SeipError
from seip_addon.core.geometry.geo_reference import projection
from seip_addon.core.progress import finish
from seip_addon.core.sumo_programs import find_sumo
from seip_addon.core.workflows.network_flows import with_flows
from seip_addon.core.workflows.network_sites import NetworkPlace, extract_places
from tests.sumo_here import needs_sumo

UTM = "+proj=utm +zone=31 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"
OFFSET = (-500_000.0, -6_000_000.0)
TOWN = Path(__file__).parents[3] / "scenes" / "town.osm"


def place(name, x, y):
    """Return a site at a place of the network by hand, metres."""
    latitude, longitude = (
        math.degrees(one.item())
        for one in projection(UTM).inverse(np.array([x - OFFSET[0]]), np.array([y - OFFSET[1]]))
    )
    return NetworkPlace(name, name, latitude, longitude, 1.0, TOWN)


SITES = (place("West", 10.0, 0.0), place("East", 500.0, 0.0))


def network(folder, *, projection_text=UTM, edges=True):
    """A street from node a to b, c and d: b and c are one junction at the west, d is that at the east."""
    nodes = {"a": -200.0, "b": 0.0, "c": 25.0, "d": 500.0, "e": 700.0}
    links = [("ab", "a", "b"), ("bc", "b", "c"), ("cd", "c", "d"), ("de", "d", "e"), ("dc", "d", "c")] if edges else []
    path = folder / "city.net.xml"
    path.write_text(
        "\n".join(
            [
                f'<net><location netOffset="{OFFSET[0]},{OFFSET[1]}" projParameter="{projection_text}"/>',
                '<edge id=":b_0" function="internal"/>',
                *(f'<edge id="{name}" from="{begin}" to="{end}"/>' for name, begin, end in links),
                *(f'<junction id="{name}" type="priority" x="{x}" y="0.0"/>' for name, x in nodes.items()),
                '<junction id=":b_0" type="internal" x="0.0" y="0.0"/>',
                "</net>",
            ]
        ),
        encoding="utf-8",
    )
    return path


def counts(folder, *intervals):
    """Output of edgeData: the vehicles that left each edge, in intervals of half an hour."""
    path = folder / "edges.xml"
    lines = ["<meandata>"]
    for number, left in enumerate(intervals):
        lines.append(f'<interval begin="{1800 * number}" end="{1800 * (number + 1)}">')
        lines += [f'<edge id="{name}" left="{value}"/>' for name, value in left.items()]
        lines.append("</interval>")
    path.write_text("\n".join([*lines, "</meandata>"]), encoding="utf-8")
    return path


def test_weights_are_vehicles_per_hour_that_drive_in(tmp_path):
    some = counts(tmp_path, {"ab": 30, "bc": 99, "cd": 20, "dc": 5, ":b_0": 7}, {"ab": 10, "cd": 4, "de": 50})
    west, east = finish(with_flows(SITES, network(tmp_path), some))
    assert (west.weight, east.weight) == (45.0, 24.0)  # in one hour; bc begins within the site
    assert (west.name, east.name) == ("West", "East")


@pytest.mark.parametrize(
    ("net", "edges", "sites", "named"),
    [
        ({"projection_text": "!"}, [{"ab": 1}], SITES, "names no projection that is known"),
        ({"edges": False}, [{"ab": 1}], SITES, "it has no edges"),
        ({}, [], SITES, "has no interval"),
        ({}, [{"ab": 0}], SITES, "counts no vehicle at any site"),
        ({}, [{"ab": "many"}], SITES, "a number of <edge> must be .* not 'many'"),
        ({}, [{"ab": 1}], (*SITES, place("North", 0.0, 900.0)), "has no street that ends at North"),
    ],
)
def test_files_that_give_no_weights_are_refused(tmp_path, net, edges, sites, named):
    with pytest.raises(SeipError, match=named):
        finish(with_flows(sites, network(tmp_path, **net), counts(tmp_path, *edges)))


def haversine(one, other):
    """Metres between two points (latitude, longitude) in degrees on a sphere."""
    (a, b), (c, d) = (tuple(map(math.radians, point)) for point in (one, other))
    chord = math.sin((c - a) / 2) ** 2 + math.cos(a) * math.cos(c) * math.sin((d - b) / 2) ** 2
    return 2 * 6_371_000.0 * math.asin(math.sqrt(chord))


def elements(path, tag):
    return list(ElementTree.parse(path).getroot().iter(tag))


@needs_sumo
def test_weights_of_a_simulation_are_the_vehicles_whose_routes_enter_the_site(tmp_path):
    """The oracle knows the routes and SUMO's own latitudes and longitudes of the nodes, not the counts of edges."""
    programs = find_sumo()
    net, routes, edges, ways = (tmp_path / f"{name}.xml" for name in ("city.net", "routes", "edges", "ways"))

    def call(program, *options):
        subprocess.run([program, *map(str, options)], cwd=tmp_path, check=True, capture_output=True)  # noqa: S603  # SUMO

    call(programs.netconvert, "--osm-files", TOWN, "-o", net, "--proj.utm", "--junctions.join", "true")
    call(programs.netconvert, "-s", net, "--plain-output-prefix", "plain", "--proj.plain-geo", "true")
    names = sorted(edge.get("id") for edge in elements(net, "edge") if not edge.get("function"))
    pairs = enumerate(zip(names, reversed(names), strict=True))
    trips = "".join(f'<trip id="{number}" depart="{number}" from="{a}" to="{b}"/>' for number, (a, b) in pairs)
    routes.write_text(f"<routes>{trips}</routes>", encoding="utf-8")
    (tmp_path / "more.xml").write_text('<additional><edgeData id="e" file="edges.xml"/></additional>', encoding="utf-8")
    more = ("-a", "more.xml", "--vehroute-output", ways, "--ignore-route-errors", "true", "--time-to-teleport", "-1")
    call(programs.sumo, "-n", net, "-r", routes, *more, "--no-step-log", "true")

    sites = finish(extract_places(TOWN, ["all"], None, 40.0))
    weighted = finish(with_flows(sites, net, edges))
    hours = float(elements(edges, "interval")[0].get("end")) / 3600.0
    nodes = {
        one.get("id"): (float(one.get("y")), float(one.get("x")))
        for one in elements(tmp_path / "plain.nod.xml", "node")
    }
    ends = {one.get("id"): (one.get("from"), one.get("to")) for one in elements(tmp_path / "plain.edg.xml", "edge")}
    driven = [route.get("edges").split() for route in elements(ways, "route")]
    assert len(driven) > 30
    for site in weighted:
        near = {name for name, point in nodes.items() if haversine(point, (site.latitude, site.longitude)) < 40.0}
        entered = [
            edge for route in driven for edge in route[:-1] if ends[edge][1] in near and ends[edge][0] not in near
        ]
        assert site.weight * hours == pytest.approx(len(entered), abs=1e-6), site.name
    assert len({site.weight for site in weighted}) > 2
