"""Survey of a site: layout, stored visibility grid, records of placements."""

from dataclasses import replace

import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.workflows.survey import grid_key, lay_out, see


def test_a_stored_grid_is_read_and_not_computed_again(small_survey, small_layout, monkeypatch):
    path = small_survey.returns_path.with_name("visibility.npz")

    def none_cast(*_args, **_kwargs):
        raise AssertionError("rays were cast again")

    monkeypatch.setattr("seip_addon.core.sensing.visibility.grid.compute_visibility", none_cast)
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
