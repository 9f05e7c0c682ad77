"""Survey of a site: keys of its grid, weights of its road users, and runs of its traffic."""

from dataclasses import replace

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.objective import Objective
from seip_addon.core.sensing.returns.road_users import RoadUsers
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.workflows.returns import CROSSING_SHARE, user_weights
from seip_addon.core.workflows.survey import grid_key, lay_out
from seip_addon.core.workflows.traffic_runs import found_runs, read_runs


@pytest.mark.parametrize(
    "change",
    [{"grid_spacing": 6.0}, {"visibility": VisibilitySettings(delta=1.5)}],
    ids=["spacing", "delta"],
)
def test_other_settings_have_another_key(small_layout, change):
    settings = replace(small_layout.settings, **change)
    assert grid_key(lay_out(small_layout.geometry, settings)) != grid_key(small_layout)


def users(bodies, crossings, weight=None):
    count = len(bodies)
    weight = np.ones(count) if weight is None else np.array(weight)
    return RoadUsers(np.zeros((count, 3)), np.array(bodies), weight, weight > 1, np.array(crossings), ("zebra",))


def test_each_kind_has_its_share_and_half_of_the_pedestrians_is_on_crossings():
    some = users([0, 0, 0, 1, 2, 2, 2, 2], [-1, -1, -1, -1, -1, -1, -1, 0])
    weights = user_weights(some, Objective(count=1, shares=(1.0, 2.0, 3.0)))
    assert weights.mean() == pytest.approx(1.0)
    by_kind = [weights[some.body == body].sum() for body in range(3)]
    np.testing.assert_allclose(by_kind, np.array([1.0, 2.0, 3.0]) / 6.0 * len(some))
    assert weights[some.crossing >= 0].sum() == pytest.approx(CROSSING_SHARE * by_kind[2])
    assert np.ptp(weights[4:7]) == 0


def test_weights_of_regions_multiply_those_of_kinds():
    some = users([0, 0, 1, 2], [-1, -1, -1, -1], [1.0, 2.0, 1.0, 1.0])
    plain, weighted = (user_weights(some, Objective(count=1, central_weight=w)) for w in (None, "scene"))
    np.testing.assert_allclose(weighted / plain, [1, 2, 1, 1])


def test_a_folder_without_runs_is_named(tmp_path):
    with pytest.raises(SeipError, match=str(tmp_path)):
        found_runs(tmp_path)


def test_a_run_that_is_given_twice_is_named(small_layout, tmp_path):
    path = tmp_path / "run.npz"
    with pytest.raises(SeipError, match=r"run\.npz is named twice"):
        finish(read_runs([path, path], small_layout))
