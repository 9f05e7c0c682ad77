"""Placements for maps and globes: GeoJSON as RFC 7946 has it, KML, and the table of targets and poses."""

import json
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely.geometry import shape

from seip_addon.core.base.errors import SeipError
from seip_addon.core.choosing.placement.objective import Objective, placement_constraints
from seip_addon.core.geometry.geo_reference import GeoReference
from seip_addon.core.output.results.geographic_files import NAMESPACE, located, save_geojson, save_kml
from seip_addon.core.output.results.site_file import load_site_file, save_site_file
from seip_addon.core.site.scene_geometry import NamedArea
from tests.builders.report_folder import make_solution
from tests.builders.small_junction import Example, make_example

OFFSET = (-4_500_000.0, 5_300_000.0, 400.0)
NAMES = {"k": NAMESPACE}


@pytest.fixture(scope="module")
def example() -> Example:
    made = make_example()
    place = GeoReference("EPSG:32632", (*OFFSET, 0.0))
    site = replace(made.site, geo_reference=place, name="Crossing <b> & \x01", attribution=("© <i>Town</i>",))
    return replace(made, site=site)


@pytest.fixture(scope="module")
def placed(example):
    return located(example.geometry, example.site, example.deployment)


@pytest.fixture(scope="module")
def features(placed, tmp_path_factory):
    path = tmp_path_factory.mktemp("geo") / "placement.geojson"
    save_geojson(path, placed)
    collection = json.loads(path.read_text(encoding="utf-8"))
    assert collection["type"] == "FeatureCollection"
    assert set(collection) == {"type", "name", "attribution", "features"}
    return collection["features"]


def in_plan(example, degrees):
    """Return longitudes and latitudes (n, 2) in metres of the site."""
    mercator = example.site.geo_reference.mercator
    east_north = np.array([mercator(latitude, longitude) for longitude, latitude in np.radians(degrees).tolist()])
    return east_north - (example.site.origin + OFFSET)[:2]


def of_kind(features, kind):
    return [one for one in features if one["properties"]["kind"] == kind]


def test_every_ring_is_closed_and_outer_ones_turn_counter_clockwise(features):
    areas = [shapely.get_parts(shape(one["geometry"])) for one in features if one["geometry"]["type"] != "Point"]
    for polygon in np.concatenate(areas):
        assert polygon.is_valid
        assert polygon.exterior.is_ccw
        assert not any(ring.is_ccw for ring in polygon.interiors)
    assert all(one["geometry"]["coordinates"][0][0] == one["geometry"]["coordinates"][0][-1] for one in features[-9:])


def test_patches_cover_the_road_once_and_name_the_sensors_that_see_it(example, features):
    found = of_kind(features, "coverage patch")
    areas = [shapely.transform(shape(one["geometry"]), lambda degrees: in_plan(example, degrees)) for one in found]
    targets = example.site.targets
    assert sum(area.area for area in areas) == pytest.approx(len(targets) * targets.spacing**2, rel=1e-4)
    for target, place in enumerate(shapely.points(targets.xyz[:, :2])):
        (own,) = (one for one, area in zip(found, areas, strict=True) if area.contains(place))
        expected = [s.label for s in example.deployment.sensors if example.visible[s.pose, target]]
        assert own["properties"]["seen_by"] == expected
        assert own["properties"]["times_seen"] == len(expected)


def test_the_region_lies_where_it_is(example, features):
    (region,) = of_kind(features, "region of interest")
    found = shapely.transform(shape(region["geometry"]), lambda degrees: in_plan(example, degrees))
    assert found.symmetric_difference(example.site.region).area < 1e-3 * example.site.region.area


def test_kml_is_xml_with_the_same_content(example, placed, features, tmp_path):
    save_kml(tmp_path / "placement.kml", placed)
    root = ET.parse(tmp_path / "placement.kml").getroot()  # noqa: S314  # our own
    assert root.tag == f"{{{NAMESPACE}}}kml"
    assert root.find("k:Document/k:name", NAMES).text == "Crossing <b> & �"
    assert (
        root.find("k:Document/k:description", NAMES).text == "© &lt;i&gt;Town&lt;/i&gt;"
    )  # which viewers show as HTML
    sensors, areas, coverage = root.findall("k:Document/k:Folder", NAMES)
    for mark, sensor in zip(sensors.findall("k:Placemark", NAMES), example.deployment.sensors, strict=True):
        assert mark.find("k:Point/k:altitudeMode", NAMES).text == "relativeToGround"
        longitude, latitude, height = map(float, mark.find("k:Point/k:coordinates", NAMES).text.split(","))
        np.testing.assert_allclose(in_plan(example, [(longitude, latitude)])[0], sensor.xyz[:2], atol=2e-3)
        assert height == pytest.approx(sensor.height)
    (region,) = of_kind(features, "region of interest")
    ring = areas.find("k:Placemark//k:outerBoundaryIs//k:coordinates", NAMES).text.split()
    outer = shapely.get_parts(shape(region["geometry"]))[0].exterior
    np.testing.assert_allclose([[float(one) for one in corner.split(",")] for corner in ring], outer.coords, atol=1e-8)
    assert len(areas.findall("k:Placemark", NAMES)) == 2
    styles = {style.get("id") for style in root.iter(f"{{{NAMESPACE}}}Style")}
    assert {link.text.removeprefix("#") for link in root.iter(f"{{{NAMESPACE}}}styleUrl")} <= styles
    seen = {mark.find("k:name", NAMES).text for mark in coverage.findall("k:Placemark", NAMES)}
    assert "Not seen" in seen
    assert any(name.startswith("Seen by S1") for name in seen)


def test_the_site_file_holds_the_problem_as_it_was_solved(example, tmp_path):
    goal = Objective(count=3, central_weight=2.5, forbidden=("signal pole 1",), mandatory=("signal pole 2",))
    geometry = replace(example.geometry, places=(NamedArea("Mill Lane", shapely.box(-100, -7, 0, 7)),))
    problem = placement_constraints(example.site, example.models, goal)
    path = tmp_path / "site.npz"
    save_site_file(path, "the key", geometry, example.site, make_solution(example, goal), problem)
    found = load_site_file(path)
    assert found.key == "the key"
    assert [(area.name, area.kind) for area in found.areas] == [
        ("central box", "weighted region"),
        ("Mill Lane", "place"),
    ]
    central = shapely.intersects_xy(geometry.weighted_regions[0].polygon, *example.site.targets.xyz[:, :2].T)
    np.testing.assert_array_equal(found.areas[0].within, central)
    np.testing.assert_array_equal(found.seen, example.deployment.rows)
    np.testing.assert_array_equal(found.targets.xyz, example.site.targets.xyz)
    np.testing.assert_array_equal(found.weights, problem.weights)
    with np.load(path) as arrays:
        for name, expected in (
            *(("price", problem.prices), ("position", problem.positions), ("xyz", problem.xyz)),
            *(("sensor", problem.labels), ("mandatory", problem.mandatory_groups), ("forbidden", ~problem.allowed)),
        ):
            np.testing.assert_array_equal(arrays[name], expected)
        header = json.loads(str(arrays["header"]))
    assert (header["count"], header["budget_usd"], header["min_distance_m"]) == (3, None, 0.0)
    assert header["groups"] == list(problem.group_names)


def test_a_damaged_site_file_is_refused(tmp_path):
    path = tmp_path / "site.npz"
    with pytest.raises(SeipError, match="place the sensors again"):
        load_site_file(path)
    path.write_bytes(b"PK\x03\x04nothing")
    with pytest.raises(SeipError, match="damaged"):
        load_site_file(path)
