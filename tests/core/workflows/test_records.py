"""Records of placements: from a solution to ``placement.json`` and back, and what makes them stale."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
import shapely

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.objective import Objective
from seip_addon.core.output.results.placement_record import Provenance, load_placement, save_placement
from seip_addon.core.site.scene_geometry import NamedArea
from seip_addon.core.workflows.placing import place, with_context
from seip_addon.core.workflows.records import inputs_of, record_of, restored_solution

MADE = Provenance(datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC), {"placement": 1.0}, {"seip": "0"})
CROSSING = NamedArea("zebra", shapely.box(-9.0, -4.0, -6.0, 4.0), crossing=True)


@pytest.fixture(scope="module")
def by_returns(small_survey):
    """A survey with a crossing, and the record of its best placement by returns."""
    geometry = replace(small_survey.geometry, places=(CROSSING,))
    survey = replace(small_survey, geometry=geometry)
    goal = Objective(count=2, criterion="returns", shares=(1.0, 2.0, 3.0))
    return survey, record_of(survey, finish(with_context(survey, finish(place(survey, goal)))), MADE)


def test_weights_change_the_site_but_not_the_visibility(small_layout):
    targets = small_layout.site.targets
    heavier = replace(targets, weight=np.where(targets.central, 5.0, 1.0))
    changed = replace(small_layout, site=replace(small_layout.site, targets=heavier))
    assert inputs_of(changed)["visibility"] == inputs_of(small_layout)["visibility"]
    assert inputs_of(changed)["site"] != inputs_of(small_layout)["site"]


def test_a_solution_is_restored_from_its_record(small_survey, tmp_path):
    solution = finish(place(small_survey, Objective(count=2)))
    save_placement(tmp_path / "placement.json", record_of(small_survey, solution, MADE))
    restored = finish(restored_solution(small_survey, load_placement(tmp_path / "placement.json")))
    np.testing.assert_array_equal(restored.placement.chosen, solution.placement.chosen)
    assert restored.placement.objective == solution.placement.objective
    assert restored.placement.status == solution.placement.status == "optimal"
    assert restored.deployment.coverage == solution.deployment.coverage
    assert restored.objective == solution.objective


def test_a_solution_by_returns_is_restored_with_its_shares_and_returns(by_returns):
    survey, record = by_returns
    restored = finish(restored_solution(survey, record))
    assert restored.objective.shares == (1.0, 2.0, 3.0)
    assert restored.deployment.returns == record.returns
    front = record.returns.front
    assert [point.count for point in front] == [1, 2, 3, 4]
    assert front[1].returns == pytest.approx(record.returns.typical, rel=1e-3)
    assert (front[1].price, front[1].gap) == (record.price_usd, 0.0)
    assert record.front == ()  # of coverage, for which it was not chosen
    assert restored.deployment.pedestrian_returns is not None


def test_a_record_of_another_grid_is_refused(small_survey):
    record = record_of(small_survey, finish(place(small_survey, Objective(count=1))), MADE)
    other = replace(record, inputs={**record.inputs, "visibility": "another"})
    with pytest.raises(SeipError, match="place again"):
        finish(restored_solution(small_survey, other))


CHANGES = {
    "a crossing that moves": lambda old: replace(old, places=(replace(CROSSING, polygon=shapely.box(6, -4, 9, 4)),)),
    "a crossing that is none": lambda old: replace(old, places=(replace(CROSSING, crossing=False),)),
    "a crossing of another name": lambda old: replace(old, places=(replace(CROSSING, name="Mill Lane"),)),
    "the edge of the pavements": lambda old: replace(old, candidate_areas=old.candidate_areas.buffer(-0.4)),
    "a weighted region that shrinks": lambda old: replace(
        old, weighted_regions=tuple(replace(one, polygon=one.polygon.buffer(-3.0)) for one in old.weighted_regions)
    ),
    "a weight of a region": lambda old: replace(
        old, weighted_regions=tuple(replace(one, weight=one.weight + 1.0) for one in old.weighted_regions)
    ),
}


@pytest.mark.parametrize("change", CHANGES)
def test_road_users_that_change_make_a_placement_by_returns_stale(by_returns, change):
    survey, record = by_returns
    assert record.is_of(inputs_of(survey))
    other = replace(survey, geometry=CHANGES[change](survey.geometry))  # with the same targets and candidates
    assert inputs_of(other)["visibility"] == record.inputs["visibility"]
    assert inputs_of(other)["site"] == record.inputs["site"]
    assert not record.is_of(inputs_of(other))
    with pytest.raises(SeipError, match="the placement is stale"):
        finish(restored_solution(other, record))
