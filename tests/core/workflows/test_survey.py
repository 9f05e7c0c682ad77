"""Survey of a site: layout, stored visibility grid, records of placements."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from seip_addon.core.choosing.placement.objective import Objective
from seip_addon.core.errors import SeipError
from seip_addon.core.output.results.placement_record import (
    Provenance,
    load_placement_record,
    save_placement_record,
)
from seip_addon.core.progress import finish
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.visibility_model import visibility_model
from seip_addon.core.workflows.placing import place
from seip_addon.core.workflows.records import record_of, restored_solution
from seip_addon.core.workflows.survey import grid_key, inputs_of, lay_out, see

MADE = Provenance(datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC), {"placement": 1.0}, {"seip": "0"})


def test_the_layout_keeps_the_scene_its_settings_and_the_warnings_of_its_reading(small_layout):
    assert set(small_layout.models) == {"type1", "type2"}
    assert small_layout.warnings[0] == "read with care"
    assert small_layout.site.targets.spacing == 4.0
    assert set(np.unique(small_layout.site.candidates.sensor)) == {"type1", "type2"}


def test_the_grid_is_that_of_each_pose_alone(small_survey):
    site = small_survey.site
    one_by_one = visibility_model(site, small_survey.settings.visibility)
    seen = small_survey.grid.visible
    for pose in range(0, len(site.candidates), 7):
        model = small_survey.models[str(site.candidates.sensor[pose])]
        alone, _ = one_by_one.see_upright([model], site.candidates.xyz[pose], float(site.candidates.yaw[pose]))
        np.testing.assert_array_equal(seen[pose], alone[0])


def test_a_stored_grid_is_read_and_not_computed_again(small_survey, small_layout, monkeypatch):
    path = small_survey.returns_path.with_name("visibility.npz")

    def none_cast(*_args, **_kwargs):
        raise AssertionError("rays were cast again")

    monkeypatch.setattr("seip_addon.core.sensing.visibility.store.compute_visibility", none_cast)
    again = finish(see(small_layout, path))
    assert again.grid.key == small_survey.grid.key
    np.testing.assert_array_equal(again.grid.packed, small_survey.grid.packed)


@pytest.mark.parametrize(
    "change",
    [{"grid_spacing": 6.0}, {"visibility": VisibilitySettings(delta=1.5)}],
    ids=["spacing", "delta"],
)
def test_other_settings_have_another_key(small_layout, change):
    settings = replace(small_layout.settings, **change)
    assert grid_key(lay_out(small_layout.geometry, settings)) != grid_key(small_layout)


def test_weights_change_the_site_but_not_the_visibility(small_layout):
    targets = small_layout.site.targets
    heavier = replace(targets, weight=np.where(targets.central, 5.0, 1.0))
    changed = replace(small_layout, site=replace(small_layout.site, targets=heavier))
    assert inputs_of(changed)["visibility"] == inputs_of(small_layout)["visibility"]
    assert inputs_of(changed)["site"] != inputs_of(small_layout)["site"]


def test_a_solution_is_restored_from_its_record(small_survey, tmp_path):
    solution = finish(place(small_survey, Objective(count=2)))
    save_placement_record(tmp_path / "placement.json", record_of(small_survey, solution, MADE))
    restored = restored_solution(small_survey, load_placement_record(tmp_path / "placement.json"))
    np.testing.assert_array_equal(restored.placement.chosen, solution.placement.chosen)
    assert restored.placement.objective == solution.placement.objective
    assert restored.placement.status == solution.placement.status == "optimal"
    assert restored.deployment.coverage == solution.deployment.coverage
    assert restored.objective == solution.objective


def test_a_record_of_another_grid_is_refused(small_survey):
    record = record_of(small_survey, finish(place(small_survey, Objective(count=1))), MADE)
    other = replace(record, inputs={**record.inputs, "visibility": "another"})
    with pytest.raises(SeipError, match="place again"):
        restored_solution(small_survey, other)
