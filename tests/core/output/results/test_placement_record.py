import json
import math
from dataclasses import asdict, replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.choosing.placement.objective import MOVED, Objective, Solution
from seip_addon.core.choosing.placement.problem import Placement
from seip_addon.core.choosing.placement.returns_summary import CrossingReturns, ReturnsSummary
from seip_addon.core.geometry.geo_reference import GeoReference
from seip_addon.core.geometry.orientation import degrees
from seip_addon.core.output.results.placement_record import (
    PlacementRecord,
    Provenance,
    comparable,
    load_placement,
    parsed_record,
    placement_record,
    save_placement,
)
from seip_addon.core.output.results.versions import versions
from seip_addon.core.site.scene_geometry import HEIGHTS_FROM
from seip_addon.core.site.sources import SourceCount
from tests.builders.small_junction import Example
from tests.oracles.json_schema import violations
from tests.oracles.placement_schema import FILE, text

GOAL = Objective(count=3, central_weight=2.5, forbidden=("pole 1",))
SCHEMA = json.loads(FILE.read_text(encoding="utf-8"))


def solution(chosen, **values) -> Placement:
    more = {"status": "feasible", "solver": "HiGHS", "price": 0.0}
    return Placement(chosen=np.array(chosen), notes=("3 suffice",), **{**more, **values})


@pytest.fixture
def run() -> dict[str, Any]:
    settings = {
        "grid_spacing_m": 1.0,
        "candidates": {"sensors": ("type1", "type2", "vlp32c"), "heights": (3.5, 5.4)},
        "goal": asdict(GOAL),
    }
    created = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
    return {
        "provenance": Provenance(created, {"visibility": 12.3456789}, versions(blender="4.5.15")),
        "settings": settings,
        "inputs": {"visibility": "ab" * 32},
        "warnings": ("rings are wide apart",),
    }


RETURNS = ReturnsSummary(
    42.5, {"car": 120.0, "cyclist": 30.0, "pedestrian": 12.0}, (CrossingReturns("Crossing of Rope Lane", 4.25),)
)


def make_record(example, run, **changes) -> PlacementRecord:
    values = {"objective": 512.0, "bound": 530.5, "gap": 18.5 / 512.0, **changes}
    best = solution([sensor.pose for sensor in example.deployment.sensors], **values)
    greedy = solution([1, 2, 3], objective=500.0, bound=531.0, gap=0.05)
    return placement_record(example.site, Solution(GOAL, best, greedy, example.deployment), **run)


def located(example) -> Example:
    """Return the junction in UTM zone 32."""
    place = GeoReference("EPSG:32632", (-4_500_000.0, 5_300_000.0, 400.0, 0.0))
    return replace(example, site=replace(example.site, geo_reference=place))


def made_by_hand(example, run) -> PlacementRecord:
    """Return the record of sensors of which a hand has turned the first."""
    first, *others = example.deployment.sensors
    turned = replace(first, pose=None, tilt=math.radians(-12.5), roll=math.radians(3.0), installation=1500.0)
    deployment = replace(example.deployment, sensors=(turned, *others), price=example.deployment.price + 1500.0)
    moved = solution([sensor.pose for sensor in others], objective=512.0, bound=math.nan, gap=math.inf, status=MOVED)
    return placement_record(example.site, Solution(GOAL, moved, None, deployment), **run)


@pytest.fixture(params=["placed", "without bound", "by hand", "by returns"])
def record(example, run, request) -> PlacementRecord:
    if request.param == "by hand":
        return made_by_hand(example, run)
    if request.param == "by returns":
        return replace(make_record(example, run), returns=RETURNS, crossings=RETURNS.crossings)
    return make_record(example, run, **({} if request.param == "placed" else {"bound": math.inf, "gap": math.inf}))


def content_of(record: PlacementRecord) -> dict:
    return json.loads(record.text())


def test_the_record_is_what_the_schema_says_and_json_can_hold_it(example, run, tmp_path):
    record = make_record(example, run)
    save_placement(tmp_path / "placement.json", record)
    assert violations(json.loads((tmp_path / "placement.json").read_text(encoding="utf-8")), SCHEMA) == []
    loaded = load_placement(tmp_path / "placement.json")
    assert loaded.objective.value == 512.0
    assert loaded.greedy.gap_to_placement == pytest.approx(12 / 512)
    assert loaded.settings["candidates"]["heights"] == [3.5, 5.4]


def test_a_record_is_written_as_it_was_read(record, tmp_path):
    save_placement(tmp_path / "one.json", record)
    read = load_placement(tmp_path / "one.json")
    save_placement(tmp_path / "other.json", read)
    assert (tmp_path / "other.json").read_bytes() == (tmp_path / "one.json").read_bytes()
    assert parsed_record(record.text()) == read
    assert read.text() == record.text()
    assert read.sensors == record.sensors
    assert read.request == record.request
    assert read.request.goal == GOAL
    assert violations(content_of(read), SCHEMA) == []


def test_a_record_of_the_version_before_opens(example, run, tmp_path):
    content = content_of(make_record(example, run)) | {"schema": "seip-placement/3"}
    del content["site"]["altitude_zero"]
    (tmp_path / "placement.json").write_text(json.dumps(content), encoding="utf-8")
    read = load_placement(tmp_path / "placement.json")
    assert read.sensors == make_record(example, run).sensors
    assert read.site.altitude_zero == ""


def test_the_schema_is_made_from_the_types_of_the_record():
    assert FILE.read_text(encoding="utf-8") == text(), "run python -m tests.oracles.placement_schema"


def test_map_coordinates_are_local_ones_plus_the_origin_to_the_micrometre(example, run):
    record = make_record(example, run)
    for entry, sensor in zip(record.sensors, example.deployment.sensors, strict=True):
        assert np.allclose(np.subtract(entry.map_m, entry.local_m), example.site.origin, atol=2e-6, rtol=0)
        assert entry.local_m == pytest.approx(sensor.xyz.tolist(), abs=1e-6)
        assert entry.position == example.site.candidates.position_name[example.site.candidates.position_of[sensor.pose]]


def test_latitude_and_longitude_are_those_of_the_map_and_its_header(example, run):
    there = located(example)
    record = make_record(there, run)
    place = there.site.geo_reference
    assert record.site.geo_reference.projection == "EPSG:32632"
    assert record.site.geo_reference.header_offset_m == (-4_500_000.0, 5_300_000.0, 400.0)
    for entry in record.sensors:
        projected = place.mercator(math.radians(entry.latitude_deg), math.radians(entry.longitude_deg))
        assert projected == pytest.approx(np.add(entry.map_m, place.header_offset[:3])[:2].tolist(), abs=2e-3)
        assert (entry.easting_m, entry.northing_m) == pytest.approx(projected, abs=2e-3)
        assert entry.altitude_m == pytest.approx(entry.map_m[2] + 400.0, abs=1e-6)
        assert entry.latitude_deg == round(entry.latitude_deg, 8)
    assert violations(content_of(record), SCHEMA) == []


@pytest.mark.parametrize(
    ("changes", "zero"),
    [
        (
            {"sources": (SourceCount("Driving lanes", "extract", 1, 0),), "origin": np.array([3.0, 4.0, 0.0])},
            "is level",
        ),
        ({"sources": (SourceCount("Driving lanes", "extract", 1, 0),), "origin": np.array([3.0, 4.0, 35.0])}, "map's"),
        ({"assumptions": (f"{HEIGHTS_FROM}hill, 2.tif, 1.0 to 9.0 m, smoothed",)}, "the heights in hill, 2.tif"),
        ({}, "whose level the map does not give"),
        ({"geo_reference": GeoReference("+proj=utm +zone=32 +geoidgrids=egm96.gtx")}, "egm96.gtx"),
    ],
)
def test_altitudes_count_from_the_level_that_the_scene_knows(example, run, changes, zero):
    record = make_record(replace(example, site=replace(example.site, **changes)), run)
    assert zero in record.site.altitude_zero


def test_northings_south_of_the_equator_are_those_of_the_southern_zone(example, run):
    north = GeoReference("+proj=utm +zone=50 +datum=WGS84", (-4_600_000.0, -8_700_000.0, 0.0, 0.0))
    record = make_record(replace(example, site=replace(example.site, geo_reference=north)), run)
    assert record.site.geo_reference.geo_reference.mercator.zone == "50S"
    for entry in record.sensors:
        assert entry.northing_m == pytest.approx(entry.map_m[1] - 8_700_000.0 + 10_000_000.0, abs=1e-3)
        ((longitude, latitude, _),) = north.geographic(np.array([entry.map_m]))
        assert (entry.longitude_deg, entry.latitude_deg) == pytest.approx((longitude, latitude), abs=1e-8)
        again = record.site.geo_reference.geo_reference.geographic(np.array([entry.map_m]))[0]
        assert again[:2] == pytest.approx((longitude, latitude), abs=1e-9)
    assert make_record(located(example), run).site.geo_reference.projection == "EPSG:32632"


def test_the_same_run_gives_the_same_record_but_for_times_and_versions(example, run):
    later = replace(run["provenance"], created=datetime(2027, 1, 1, tzinfo=UTC), durations={"visibility": 99.0})
    first, second = make_record(example, run), make_record(example, {**run, "provenance": later})
    assert first != second
    assert comparable(first) == comparable(second)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ('{"schema": "seip-placement/0"}', "seip-placement/0"),
        ('{"schema": "seip-placement/4", "site": 3}', "is damaged"),
    ],
)
def test_a_foreign_file_is_refused_in_one_sentence(tmp_path, content, says):
    path = tmp_path / "placement.json"
    path.write_bytes(content.encode("latin-1"))
    with pytest.raises(SeipError, match=says):
        load_placement(path)


def test_headings_are_counter_clockwise_from_zero_to_below_a_full_turn():
    assert degrees(-math.pi / 2) == 270.0
    assert degrees(2 * math.pi - 1e-12) == 0.0
    assert degrees(-1e-12) == 0.0
