"""An early answer is the exact value of a placement that the objective allows, before the grids are computed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from seip_addon.core.base.progress import Progress, finish
from seip_addon.core.choosing.placement.objective import Objective
from seip_addon.core.sensing.returns.returns_grid import compute_returns
from seip_addon.core.sensing.returns.road_users import road_users
from seip_addon.core.workflows import early_answer as early
from seip_addon.core.workflows.placing import place
from seip_addon.core.workflows.returns import SurveyReturns


@pytest.mark.parametrize("criterion", ["road", "returns"])
def test_it_is_the_optimum_where_all_poses_are_among_the_few(small_survey, tmp_path, criterion):
    objective = Objective(count=2, criterion=criterion)
    said = []
    solution = finish(place(small_survey, objective), said.append)
    assert solution.placement.status == "optimal"
    layout = small_survey
    few = early.few_poses(layout, objective)
    np.testing.assert_array_equal(few, np.arange(len(layout.site.candidates)))
    answer = finish(early.early_answer(layout, objective, tmp_path / "none.npz"))
    (last,) = [step for step in said if step.best][-1:]
    assert (answer.best, answer.poses) == (last.best, last.poses)
    assert answer.poses == tuple(sorted(solution.placement.chosen.tolist()))


def test_it_is_the_value_of_a_placement_of_the_few(small_survey, tmp_path, monkeypatch):
    """The same value follows from the grids of all poses, for the best pair of the few, found by enumeration."""
    monkeypatch.setattr(early, "EARLY_POSES", 6)
    objective = Objective(count=2, criterion="returns")
    site, users = small_survey.site, road_users(small_survey.geometry)
    whole = finish(compute_returns(site, users, small_survey.models))
    returns = SurveyReturns(small_survey, objective, users, whole)
    problem, position = returns.problem(), site.candidates.position_of
    few = early.few_poses(small_survey, objective).tolist()
    assert 3 <= len(few) < len(position)
    pairs = [np.array([a, b]) for a in few for b in few if a < b and position[a] != position[b]]
    best = max(pairs, key=problem.value)
    answer = finish(early.early_answer(small_survey, objective, tmp_path / "none.npz"))
    assert answer.best == returns.describe(best, problem.value(best))
    assert set(answer.poses) == set(best.tolist())


def test_the_few_have_all_heights_and_types_and_the_required_positions():
    heights, types, places = 4, 6, 168
    position = np.repeat(np.arange(places), heights * types)
    with pytest.MonkeyPatch.context() as patch:
        mandatory = (position == 77)[None]
        patch.setattr(early, "placement_constraints", lambda *_: SimpleNamespace(mandatory=mandatory))
        site = SimpleNamespace(candidates=np.zeros(len(position)))
        few = early.few_poses(SimpleNamespace(site=site, models={}), Objective())
    assert set(np.flatnonzero(position == 77)) <= set(few.tolist())
    spread = few[position[few] != 77]
    assert len(np.unique(position[spread])) >= 60
    assert set(spread // types % heights) == set(range(heights))
    assert set(spread % types) == set(range(types))


def test_there_is_none_for_a_stored_grid_a_coverage_or_what_the_few_do_not_allow(small_survey, tmp_path, monkeypatch):
    objective = Objective(count=2, criterion="road")
    stored = tmp_path / "visibility.npz"
    small_survey.grid.save(stored)
    assert not finish(early.early_answer(small_survey, objective, stored)).best
    replace(small_survey.grid, key="of other inputs").save(stored)
    assert finish(early.early_answer(small_survey, objective, stored)).best
    cheapest = replace(objective, count=None, coverage=0.5)
    assert not finish(early.early_answer(small_survey, cheapest, tmp_path / "none.npz")).best
    far_apart = replace(objective, min_distance=1e4)
    monkeypatch.setattr(early, "EARLY_POSES", 1)
    names = small_survey.site.candidates.position_name
    required = replace(far_apart, mandatory=(str(names[0]), str(names[-1])))
    assert not finish(early.early_answer(small_survey, required, tmp_path / "none.npz")).best


def test_it_is_reported_until_the_search_has_a_value():
    def search():
        yield Progress(1, 2, "visibility")
        yield Progress(0, 0, "improving the placement", best="71% of the road", poses=(2, 7))
        yield Progress(0, 3, "fewer and more sensors")
        return "end"

    said = []
    first = Progress(0, 0, "early answer", best="65% of the road", poses=(4,))
    assert finish(early.after_early_answer(first, search()), lambda one: said.append((one.best, one.poses))) == "end"
    assert said == [("65% of the road", (4,)), ("71% of the road", (2, 7)), ("", ())]
