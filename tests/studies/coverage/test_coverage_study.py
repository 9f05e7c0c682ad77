"""The study solves every cell, and records those that have no answer."""

import csv
from dataclasses import replace

from headless.studies.claims import save_claims
from headless.studies.coverage.cells import CENTRAL_WEIGHTS, COUNTS, EmptyCell, coverage_study
from headless.studies.coverage.charts import save_height_chart, save_weight_chart
from headless.studies.coverage.claims import coverage_claims
from headless.studies.coverage.command import save_study_table

import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.site.site import Site
from tests.builders.small_junction import make_example


@pytest.fixture(scope="module")
def example():
    return make_example(spacing=3.0)


@pytest.fixture(scope="module")
def study(example):
    return finish(coverage_study(example.site, example.models, example.visible))


def test_every_cell_is_solved_within_its_own_type_and_height(example, study):
    sensors, heights = len(study.sensors), len(study.heights)
    assert len(study.cases) == sensors * len(COUNTS) * (heights + 1 + len(CENTRAL_WEIGHTS))
    candidates = example.site.candidates
    for case in study.cases:
        assert set(candidates.sensor[case.placement.chosen]) == {case.sensor}
        if case.height is not None:
            assert set(candidates.height[case.placement.chosen]) == {case.height}
        assert len(case.placement.chosen) <= case.count


def test_free_heights_are_no_worse_than_any_one_height(study):
    for sensor in study.sensors:
        for count in COUNTS:
            free = study.find(sensor, count).placement
            for height in study.heights:
                assert free.bound >= study.find(sensor, count, height).placement.objective


def test_greedy_keeps_its_promise(study):
    claim = next(claim for claim in coverage_claims(study) if claim.number == 10)
    assert claim.verdict == "holds"


def solved(example, site: Site | None = None, visible=None):
    return finish(coverage_study(site or example.site, example.models, example.visible if visible is None else visible))


def only_positions(example, count) -> tuple[Site, np.ndarray]:
    """The example with its first few positions alone, and its grid."""
    candidates = example.site.candidates
    kept = candidates.position_of < count
    per_pose = {
        name: getattr(candidates, name)[kept] for name in ("position_of", "sensor", "height", "xyz", "yaw", "tilt")
    }
    names = ("position", "position_name", "on_pole", "pole_source")
    per_position = {name: getattr(candidates, name)[:count] for name in names}
    fewer = replace(candidates, **per_pose, **per_position, mandatory=np.zeros((0, count), bool))
    return replace(example.site, candidates=fewer), example.visible[kept]


def test_more_sensors_than_positions_leave_those_cells_empty_and_the_rest_solved(example, tmp_path):
    study = solved(example, *only_positions(example, 3))
    empty = [cell for cell in study.cells if isinstance(cell, EmptyCell)]
    assert {cell.count for cell in empty} == {4}
    assert {cell.note for cell in empty} == {
        "4 sensors are requested, but there are only 3 positions; request at most 3",
    }
    assert {case.count for case in study.cases} == {1, 2}
    verdicts = {claim.number: claim.verdict for claim in coverage_claims(study)}
    assert verdicts[2] == verdicts[4] == "undecided"
    write_all(tmp_path, study)
    rows = read_table(tmp_path / "coverage.csv")
    assert len(rows) == len(study.cells)
    assert {row["note"] for row in rows if not row["coverage"]} == {cell.note for cell in empty}
    assert all((row["coverage"] == "") == (row["count"] == "4") for row in rows)


def write_all(folder, study):
    save_height_chart(folder / "heights.png", study, "Small junction")
    save_weight_chart(folder / "weights.png", study, "Small junction")
    save_study_table(folder / "coverage.csv", study)
    save_claims(folder / "claims.md", coverage_claims(study), "Small junction")


def read_table(path):
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
