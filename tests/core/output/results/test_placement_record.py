import copy
import json
import math
import re
from collections.abc import Iterator
from dataclasses import asdict, fields, replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pytest

from seip_addon.core.choosing.placement.objective import MOVED, Objective, Solution
from seip_addon.core.choosing.placement.problem import Placement
from seip_addon.core.choosing.placement.returns_summary import CrossingReturns, ReturnsPoint, ReturnsSummary
from seip_addon.core.errors import SeipError
from seip_addon.core.geometry.geo_reference import GeoReference
from seip_addon.core.output.results.placement_file import comparable, load_placement, parsed_record, save_placement
from seip_addon.core.output.results.placement_record import PlacementRecord, Provenance, placement_record
from seip_addon.core.output.results.recorded_settings import RecordedSettings
from seip_addon.core.output.results.versions import versions
from tests.builders.small_junction import Example, make_example
from tests.oracles.json_schema import violations
from tests.oracles.placement_schema import FILE, text

GOAL = Objective(count=3, central_weight=2.5, forbidden=("pole 1",))
LEFT_OUT = ("roll_deg", "installation_usd")  # of sensors that have none
SCHEMA = json.loads(FILE.read_text(encoding="utf-8"))
SOURCE = {"kind": "Tree", "source": "map", "count": 3, "assumed": 1}


def solution(chosen, **values) -> Placement:
    more = {"status": "feasible", "solver": "HiGHS", "seconds": 0.5, "covered": values["objective"], "price": 0.0}
    return Placement(chosen=np.array(chosen), notes=("3 suffice",), **{**more, **values})


@pytest.fixture(scope="module")
def example() -> Example:
    return make_example()


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


@pytest.fixture
def whole(example, run) -> dict:
    """Return a record with all that one can hold, as JSON."""
    by_hand = made_by_hand(located(example), run)
    (one, *_), greedy = by_hand.sensors, make_record(example, run).greedy
    coverage = replace(by_hand.coverage, whole=one.coverage_added, seen_twice=0.0)
    return content_of(
        replace(
            by_hand,
            sensors=(one,),
            price_usd=one.price_usd,
            coverage=coverage,
            greedy=greedy,
            returns=RETURNS,
            crossings=RETURNS.crossings,
        )
    )


def content_of(record: PlacementRecord) -> dict:
    return json.loads(record.text())


def every_place(value: object, place: tuple = ()) -> Iterator[tuple]:
    """Yield the keys that lead to each value within a value of JSON."""
    for key, part in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield (*place, key)
        yield from every_place(part, (*place, key))


def parent(content: dict, place: tuple) -> dict | list:
    for key in place[:-1]:
        content = content[key]
    return content


def refusal(content: dict) -> str:
    """Return the sentence with which a record is refused; nothing for one that is read, and can be written again."""
    try:
        record = parsed_record(json.dumps(content))
    except SeipError as error:
        return str(error)
    assert content_of(record)["schema"] == content["schema"]
    return ""


def is_open(place: tuple) -> bool:
    """Return whether a value is none that this program reads again, so that it may be anything."""
    return place[0] == "settings" and place[1:2] not in {(), *((each.name,) for each in fields(RecordedSettings))}


def test_the_record_is_what_the_schema_says_and_json_can_hold_it(example, run, tmp_path):
    record = make_record(example, run)
    save_placement(tmp_path / "placement.json", record)
    assert violations(json.loads((tmp_path / "placement.json").read_text(encoding="utf-8")), SCHEMA) == []
    loaded = load_placement(tmp_path / "placement.json")
    assert loaded.objective.value == 512.0
    assert loaded.greedy.gap_to_placement == pytest.approx(12 / 512)
    assert loaded.settings["candidates"]["heights"] == [3.5, 5.4]


def test_what_greedy_loses_of_returns_is_a_share_of_returns(example, run):
    """The objective is then the mean of ln(1 + returns)."""
    deployment = replace(example.deployment, returns=RETURNS)
    chosen = [sensor.pose for sensor in deployment.sensors]
    best = solution(chosen, objective=3.8434, bound=3.8434, gap=0.0)
    greedy = solution([1, 2, 3], objective=3.8116, bound=3.8434, gap=0.0)
    record = placement_record(example.site, Solution(GOAL, best, greedy, deployment), **run)
    assert record.greedy.gap_to_placement == pytest.approx(1 - math.exp(3.8116 - 3.8434))


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


def test_the_schema_is_made_from_the_types_and_limits_of_the_record():
    assert FILE.read_text(encoding="utf-8") == text(), "run python -m tests.oracles.placement_schema"


def test_every_number_of_the_schema_has_limits():
    def numbers(part, where):
        if isinstance(part, dict):
            if part.get("type") in {"number", "integer"}:
                yield where, part
            for name, inner in part.items():
                yield from numbers(inner, f"{where}.{name}")
        elif isinstance(part, list):
            for inner in part:
                yield from numbers(inner, where)

    found = dict(numbers(SCHEMA, "$"))
    assert len(found) > 40
    assert not {where for where, part in found.items() if not {"minimum", "maximum"} <= part.keys()}


@pytest.mark.parametrize(
    ("change", "beyond"),
    [
        (lambda content: content["site"]["origin_m"].__setitem__(0, 2e8), "site.origin_m"),
        (lambda content: content["sensors"][0].__setitem__("price_usd", 2e9), "price_usd"),
        (lambda content: content["site"].__setitem__("sources", [SOURCE | {"assumed": -1}]), "sources"),
        (lambda content: content["seeds"].__setitem__("scan", -1), "seeds.scan"),
    ],
)
def test_reader_and_schema_refuse_the_same(record, change, beyond):
    content = json.loads(json.dumps(record.as_json()))
    change(content)
    assert any(beyond in found for found in violations(content, SCHEMA))
    with pytest.raises(SeipError, match=beyond):
        parsed_record(json.dumps(content))


def test_the_keys_are_in_the_order_of_the_schema(record):
    content = content_of(record)
    assert list(content) == [name for name in SCHEMA["properties"] if name != "returns" or record.returns is not None]
    for sensor in content["sensors"]:
        named = SCHEMA["properties"]["sensors"]["items"]["properties"]
        assert list(sensor) == [name for name in named if name not in LEFT_OUT or sensor["pose"] is None]


def test_a_sensor_is_turned_as_it_hangs(example, run):
    for recorded, sensor in zip(make_record(example, run).sensors, example.deployment.sensors, strict=True):
        assert np.allclose(recorded.orientation, sensor.orientation, rtol=0, atol=1e-7)
    turned = made_by_hand(example, run).sensors[0]
    assert turned.roll_deg == 3.0
    assert not np.allclose(turned.orientation, replace(turned, roll_deg=None).orientation, rtol=0, atol=1e-3)


def test_keys_of_which_this_version_knows_nothing_are_passed_over(whole):
    content = copy.deepcopy(whole)
    for place in [(), *every_place(whole)]:
        value = parent(content, (*place, ""))
        if isinstance(value, dict) and not set(place) & {
            "settings",
            "dropped",
            "inputs",
            "versions",
            "durations_s",
            "of_each",
        }:
            value["more"] = 1.0
    assert content["sensors"][0]["more"]
    content["seeds"].pop("more")
    assert content_of(parsed_record(json.dumps(content))) == whole


CONTRADICTIONS = {
    ("sensors", 0): "the prices of the sensors add up to 0",
    ("returns", "crossings", 0): "returns.crossings and crossings contradict each other",
}
"""Parts without which the others contradict each other, which a schema cannot state."""


def test_a_part_that_is_missing_is_missed(whole):
    for place in every_place(whole):
        changed = copy.deepcopy(whole)
        del parent(changed, place)[place[-1]]
        contradiction = CONTRADICTIONS.get(place)
        if contradiction:
            assert contradiction in refusal(changed)
        else:
            assert bool(refusal(changed)) == bool(violations(changed, SCHEMA)), place


@pytest.mark.parametrize(
    "value", [None, True, "text", 0.5, math.nan, math.inf, pytest.param(10**400, id="vast"), [], [0.5], {}, {"a": []}]
)
def test_a_part_of_another_type_is_refused(whole, value):
    for place in every_place(whole):
        changed = copy.deepcopy(whole)
        parent(changed, place)[place[-1]] = value
        sentence = refusal(changed)
        if sentence:
            assert re.fullmatch(r"the placement that this scene keeps .*; place the sensors again.*", sentence)
        elif violations(changed, SCHEMA):
            absent = value is None and place[-1] in {"returns", *LEFT_OUT}
            assert is_open(place) or absent or (place[-1], value) == ("status", "text"), place


def test_a_text_that_no_file_can_hold_is_refused(record):
    with pytest.raises(SeipError, match="damaged"):
        parsed_record(record.text().replace("rings", "\\ud800"))


def test_a_tilt_is_in_degrees_and_upright_is_zero(example, run):
    first, *others = example.deployment.sensors
    deployment = replace(example.deployment, sensors=(replace(first, tilt=math.radians(-12.5)), *others))
    record = make_record(replace(example, deployment=deployment), run)
    assert [sensor.tilt_deg for sensor in record.sensors] == [-12.5, *(0.0 for _ in others)]
    content = content_of(record)
    assert violations(content, SCHEMA) == []
    content["sensors"][0]["tilt_deg"] = 91.0
    assert violations(content, SCHEMA)


def test_every_required_part_is_missed_when_it_is_absent(example, run):
    record = content_of(make_record(example, run))
    for part in SCHEMA["required"]:
        assert violations({key: value for key, value in record.items() if key != part}, SCHEMA)
    assert violations({**record, "more": 1}, SCHEMA)


def test_settings_of_the_work_are_accepted_and_held_to_their_types(example, run):
    work = {"engine": "auto", "solver": "highs", "catalogue": ["mine.toml"], "render": True, "time_limit_s": 60.0}
    record = content_of(make_record(example, {**run, "settings": {**run["settings"], **work}}))
    assert violations(record, SCHEMA) == []
    for name in work:
        assert violations({**record, "settings": {**record["settings"], name: None}}, SCHEMA)


def test_nothing_random_is_claimed(example, run):
    assert make_record(example, run).seeds == {}


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


def test_without_a_known_projection_there_is_no_latitude(example, run):
    for place in (GeoReference(), GeoReference("+proj=merc"), GeoReference("EPSG:32632", (0.0, 0.0, 0.0, 0.5))):
        record = make_record(replace(example, site=replace(example.site, geo_reference=place)), run)
        assert {(entry.latitude_deg, entry.easting_m) for entry in record.sensors} == {(None, None)}
        assert (record.site.geo_reference is None) == (not place.projection)
        assert violations(content_of(record), SCHEMA) == []


def test_a_record_of_before_there_were_latitudes_is_read(example, run):
    content = content_of(make_record(example, run))
    del content["site"]["geo_reference"]
    for sensor in content["sensors"]:
        for name in ("latitude_deg", "longitude_deg", "altitude_m", "easting_m", "northing_m"):
            del sensor[name]
    assert violations(content, SCHEMA) == []
    assert parsed_record(json.dumps(content)) == parsed_record(make_record(example, run).text())


def test_the_same_run_gives_the_same_bytes_but_for_times_and_versions(example, run, tmp_path):
    later = replace(run["provenance"], created=datetime(2027, 1, 1, tzinfo=UTC), durations={"visibility": 99.0})
    first, second = make_record(example, run), make_record(example, {**run, "provenance": later})
    assert first != second
    assert comparable(first) == comparable(second)
    for name in ("a.json", "b.json"):
        save_placement(tmp_path / name, first)
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


def test_a_bound_that_was_not_found_is_null(example, run, tmp_path):
    record = make_record(example, run, bound=math.inf, gap=math.inf)
    save_placement(tmp_path / "placement.json", record)
    assert record.objective.bound is None
    assert violations(content_of(record), SCHEMA) == []


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("{", "damaged"),
        ('{"schema": "seip-placement/0"}', "seip-placement/0"),
        ("[1]", "None"),
        (
            '{"schema": "seip-placement/3", "site": 3}',
            "json is damaged .*: site must be an object, not 3; place",
        ),
        ("[" * 100_000, "damaged"),
        ("\xff", "damaged"),
    ],
)
def test_a_foreign_file_is_refused_in_one_sentence(tmp_path, content, says):
    path = tmp_path / "placement.json"
    path.write_bytes(content.encode("latin-1"))
    with pytest.raises(SeipError, match=says):
        load_placement(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(SeipError, match="No such file"):
        load_placement(tmp_path / "nothing.json")


def test_versions_name_the_program_and_its_libraries():
    found = versions(blender="5.2.0")
    assert list(found) == ["seip", "python", "numpy", "shapely", "pulp", "highspy", "blender"]
    assert found["numpy"] == np.__version__


FAULTS = {
    "a height below all ground": (("sensors", 0, "height_m"), -1e308, r"height_m is -1e\+308, not -1,000 to 1,000 m"),
    "a place beyond the site": (("sensors", 0, "local_m", 1), 1e30, "not -10,000,000 to 10,000,000 m"),
    "a negative price": (("sensors", 0, "price_usd"), -5.0, "price_usd is -5, not 0 to"),
    "another sum": (("price_usd",), 3.0, "price_usd is 3, but the prices of the sensors add up to"),
    "an impossible share": (("coverage", "whole"), 3e29, r"whole is 3e\+29, not 0 to 1"),
    "another coverage": (("coverage", "whole"), 0.999, "the sensors add up to"),
    "more seen twice": (("coverage", "seen_twice"), 1.0, "seen_twice is above coverage.whole"),
    "a marginal share above its own": (
        ("sensors", 1, "coverage_marginal"),
        0.9,
        "the coverages of sensor 'S2' contradict each other",
    ),
    "a label twice": (("sensors", 1, "id"), "S1", "2 sensors have the id 'S1'"),
    "a tilt of many turns": (("sensors", 0, "tilt_deg"), 1e6, "not -360 to 360 degrees"),
    "another place of the map": (("sensors", 0, "map_m", 0), 7.0, "local_m and map_m of sensor 'S1'"),
    "a value above its bound": (("objective", "bound"), 1.0, "objective.value .* is better than objective.bound 1"),
    "a proof with a gap": (("objective", "status"), "optimal", "objective.status is 'optimal', but objective.bound"),
    "another gap": (("objective", "gap"), 0.5, "objective.gap is 0.5, but the gap of value and bound is"),
    "a greedy value above the bound": (("greedy", "value"), 9999.0, "greedy.value 9999 is above objective.bound"),
    "no date": (("times", "created"), "x", "times.created is not a date and time: 'x'"),
    "fewer than no targets": (("counts", "targets"), -1, "counts.targets is -1"),
    "more central targets": (("counts", "targets_central"), 10**9, "targets_central is above counts.targets"),
    "a planned sensor in the ground": (("sensors", 0, "height_m"), -5.0, "height_m of sensor 'S1' is -5"),
    "no number of sensors": (("settings", "goal", "count"), -5, "the number of sensors must be 1 to 100,000, not -5"),
    "more sensors than the objective allows": (("settings", "goal", "count"), 1, "3 sensors are more than settings"),
    "a price above the budget": (("settings", "goal", "budget"), 1.0, "price_usd .* is above settings.goal.budget"),
    "an objective of another kind": (("settings", "goal", "coverage"), 0.5, "not what settings.goal asks for"),
    "a spacing beyond all": (("settings", "grid_spacing_m"), 3e29, r"grid_spacing_m is 3e\+29, not"),
    "a negative height to choose from": (("settings", "candidates", "heights"), [-5.0], "a mounting height must be"),
    "a setting in words": (("settings", "effort"), "x", "settings.effort must be a number"),
    "a negative effort": (("settings", "effort"), -1e308, r"settings.effort is -1e\+308, not"),
    "another delta": (("settings", "visibility"), {"delta": 3e29}, "delta must be a positive number of metres"),
    "another greedy gap": (("greedy", "gap_to_placement"), 0.9, "greedy.gap_to_placement is 0.9, but greedy reaches"),
    "a type that was not there": (("sensors", 0, "sensor"), "os2_128", "'os2_128' is not in settings.candidates"),
    "an endless step": (("times", "durations_s", "visibility"), 1e300, "not 0 to 2,592,000 s"),
}


FRONT = (ReturnsPoint(1, 20.0, 10_000.0, 0.5), ReturnsPoint(2, 42.5, 20_000.0, 0.25), ReturnsPoint(3, 60.0, 3e4, None))
FAULTS_OF_RETURNS = {
    "another mean": (("returns", "typical"), 43.5, "returns.typical is 43.5, but objective.value is the logarithm"),
    "another crossing": (("returns", "crossings", 0, "least"), 99.0, "returns.crossings and crossings contradict"),
    "fewer returns of more sensors": (("returns", "front", 1, "returns"), 19.0, "returns.front .* at 2 sensors"),
    "a lower bound of more sensors": (("returns", "front", 0, "gap"), 9.0, "returns.front .* at 2 sensors"),
    "the same number twice": (("returns", "front", 1, "count"), 1, "returns.front contradicts itself at 1 sensors"),
}


@pytest.mark.parametrize("name", FAULTS_OF_RETURNS)
def test_contradicting_returns_are_refused(example, run, name):
    place, value, complaint = FAULTS_OF_RETURNS[name]
    returns = replace(RETURNS, front=FRONT)
    known = replace(example.deployment, returns=returns)
    chosen = [sensor.pose for sensor in known.sensors]
    best = solution(chosen, objective=math.log(43.5), bound=math.log(43.5), gap=0.0)
    made = placement_record(example.site, Solution(GOAL, best, None, known, crossings=RETURNS.crossings), **run)
    content = content_of(made)
    assert not refusal(content)
    parent(content, place)[place[-1]] = value
    assert re.search(complaint, refusal(content)), refusal(content)


def test_logarithms_of_returns_beyond_all_floats_are_refused(example, run):
    made = make_record(example, run)
    content = content_of(replace(made, returns=RETURNS, crossings=RETURNS.crossings))
    content["objective"] |= {"sought": "most returns", "value": 1e6, "bound": None, "gap": None}
    assert "but objective.value is the logarithm of 1.0142" in refusal(content)
    content["objective"] |= {"value": math.log(43.5), "bound": 1e6}
    content["greedy"] |= {"value": 1e6}
    assert "greedy.gap_to_placement is" in refusal(content)


def test_geographic_coordinates_that_contradict_the_map_are_refused(example, run):
    for name in ("latitude_deg", "longitude_deg", "altitude_m", "easting_m"):
        content = content_of(make_record(located(example), run))
        assert not refusal(content)
        content["sensors"][1][name] += 0.01
        assert re.search(f"{name}.* of sensor 'S2' are not", refusal(content))


@pytest.mark.parametrize("name", FAULTS)
def test_figures_beyond_their_limits_or_in_contradiction_are_refused(example, run, name):
    place, value, complaint = FAULTS[name]
    content = content_of(make_record(example, run))
    assert not refusal(content)
    parent(content, place)[place[-1]] = value
    assert re.search(complaint, refusal(content)), refusal(content)
