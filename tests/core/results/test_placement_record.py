import json
import math
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.placement import Placement
from seip_addon.core.placement.objective import Objective, Solution
from seip_addon.core.results.placement_record import (
    Run,
    comparable,
    load_placement_record,
    placement_record,
    save_placement_record,
    versions,
)
from tests.json_schema import violations
from tests.small_junction import Example, make_example

SCHEMA = json.loads((Path(__file__).parents[3] / "docs" / "placement.schema.json").read_text(encoding="utf-8"))


def solution(chosen, **values) -> Placement:
    more = {"status": "feasible", "solver": "HiGHS", "seconds": 0.5, "covered": values["objective"], "price": 0.0}
    return Placement(chosen=np.array(chosen), notes=("3 suffice",), **{**more, **values})


@pytest.fixture(scope="module")
def example() -> Example:
    return make_example()


@pytest.fixture
def run() -> Run:
    return Run(
        settings={"delta_m": 1.0, "heights_m": (3.5, 5.4), "budget_usd": None},
        created=datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC),
        durations={"visibility": 12.3456789},
        versions=versions(blender="4.5.15"),
        inputs={"visibility": "ab" * 32},
        warnings=("rings are wide apart",),
    )


def make_record(example, run, **changes):
    values = {"objective": 512.0, "bound": 530.5, "gap": 18.5 / 512.0, **changes}
    best = solution([sensor.pose for sensor in example.deployment.sensors], **values)
    greedy = solution([1, 2, 3], objective=500.0, bound=531.0, gap=0.05)
    return placement_record(example.site, Solution(Objective(count=3), best, greedy, example.deployment), run)


def test_the_record_is_what_the_schema_says_and_json_can_hold_it(example, run, tmp_path):
    record = make_record(example, run)
    save_placement_record(tmp_path / "placement.json", record)
    loaded = load_placement_record(tmp_path / "placement.json")
    assert violations(loaded, SCHEMA) == []
    assert loaded["objective"]["value"] == 512.0
    assert loaded["greedy"]["gap_to_placement"] == pytest.approx(12 / 512)
    assert loaded["settings"]["heights_m"] == [3.5, 5.4]


def test_a_tilt_is_in_degrees_and_upright_is_zero(example, run):
    first, *others = example.deployment.sensors
    deployment = replace(example.deployment, sensors=(replace(first, tilt=math.radians(-12.5)), *others))
    record = make_record(replace(example, deployment=deployment), run)
    assert [sensor["tilt_deg"] for sensor in record["sensors"]] == [-12.5, *(0.0 for _ in others)]
    assert violations(json.loads(json.dumps(record)), SCHEMA) == []
    record["sensors"][0]["tilt_deg"] = 91.0
    assert violations(json.loads(json.dumps(record)), SCHEMA)


def test_every_required_part_is_missed_when_it_is_absent(example, run):
    record = json.loads(json.dumps(make_record(example, run)))
    for part in SCHEMA["required"]:
        assert violations({key: value for key, value in record.items() if key != part}, SCHEMA)
    assert violations({**record, "more": 1}, SCHEMA)


def test_settings_of_the_work_are_accepted_and_held_to_their_types(example, run):
    work = {"engine": "auto", "solver": "highs", "catalogue": ["mine.toml"], "render": True, "time_limit_s": 60.0}
    record = make_record(example, replace(run, settings=work))
    assert violations(record, SCHEMA) == []
    for name in work:
        assert violations({**record, "settings": {**work, name: None}}, SCHEMA)


def test_nothing_random_is_claimed(example, run):
    assert make_record(example, run)["seeds"] == {}


def test_map_coordinates_are_local_ones_plus_the_origin_to_the_micrometre(example, run):
    record = make_record(example, run)
    for entry, sensor in zip(record["sensors"], example.deployment.sensors, strict=True):
        assert np.allclose(np.subtract(entry["map_m"], entry["local_m"]), example.site.origin, atol=2e-6, rtol=0)
        assert entry["local_m"] == pytest.approx(sensor.xyz.tolist(), abs=1e-6)
        assert (
            entry["position"] == example.site.candidates.position_name[example.site.candidates.position_of[sensor.pose]]
        )


def test_the_same_run_gives_the_same_bytes_but_for_times_and_versions(example, run, tmp_path):
    later = Run(**{**vars(run), "created": datetime(2027, 1, 1, tzinfo=UTC), "durations": {"visibility": 99.0}})
    first, second = make_record(example, run), make_record(example, later)
    assert first != second
    assert comparable(first) == comparable(second)
    for name in ("a.json", "b.json"):
        save_placement_record(tmp_path / name, first)
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


def test_a_bound_that_was_not_found_is_null(example, run, tmp_path):
    record = make_record(example, run, bound=math.inf, gap=math.inf)
    save_placement_record(tmp_path / "placement.json", record)
    assert record["objective"]["bound"] is None
    assert violations(record, SCHEMA) == []


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("{", "damaged"),
        ('{"schema": "seip-placement/0"}', "seip-placement/0"),
        ("[1]", "None"),
    ],
)
def test_a_foreign_file_is_refused_in_one_sentence(tmp_path, content, says):
    path = tmp_path / "placement.json"
    path.write_text(content)
    with pytest.raises(SeipError, match=says):
        load_placement_record(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(SeipError, match="No such file"):
        load_placement_record(tmp_path / "nothing.json")


def test_versions_name_the_program_and_its_libraries():
    found = versions(blender="5.2.0")
    assert list(found) == ["seip", "python", "numpy", "shapely", "pulp", "highspy", "blender"]
    assert found["numpy"] == np.__version__
