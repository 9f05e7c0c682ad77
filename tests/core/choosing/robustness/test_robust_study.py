"""What placing for pose errors costs and saves, and the charts of it."""

import math
from dataclasses import replace
from functools import cache

from headless.charts.pose_errors import save_frontier_chart, save_loss_chart, save_spread_chart
from headless.studies.stability.robustness_rows import robust_rows

import numpy as np
import pytest
from matplotlib.image import imread

from seip_addon.core.choosing.placement.deployment import deploy
from seip_addon.core.choosing.placement.objective import Objective, placement_problem
from seip_addon.core.choosing.placement.risk import Risk
from seip_addon.core.choosing.placement.scenarios import PoseErrors, Scenarios
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.choosing.robustness.pose_study import PoseStudySettings, pose_study
from seip_addon.core.choosing.robustness.robust_study import robust_study
from seip_addon.core.choosing.robustness.visibility_under_errors import draws_for, visibility_under_errors
from seip_addon.core.progress import Progress, finish
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.visibility.grid import VisibilitySettings, compute_visibility
from seip_addon.core.sensing.visibility.surroundings import Surroundings
from tests.builders.synthetic_junction import junction_site
from tests.engines import ANY

MODELS = load_catalogue()
SCENARIOS = Scenarios("pose-errors", count=4, held_out=20)
LIMITS = SolverLimits(time_limit=20.0)


@pytest.fixture(scope="module")
def laid_out():
    site = junction_site(positions=8, sensors=("type1", "type2"), heights=(5.4,), spacing=4.0)
    around = Surroundings(site, MODELS, VisibilitySettings(delta=2.0), engine=ANY)
    grid = finish(compute_visibility(site, MODELS, around.sight, ANY))
    goal = placement_problem(site, grid.visible, MODELS, Objective(count=2))
    return around, replace(goal, forbidden=site.candidates.sensor == "type2")


@pytest.fixture(scope="module")
def study(laid_out):
    return finish(robust_study(*laid_out, SCENARIOS, [Risk(), Risk(tail=0.0)], LIMITS))


@pytest.mark.slow
def test_all_are_evaluated_by_draws_that_none_was_chosen_on(laid_out, study):
    around, problem = laid_out
    (nominal,) = study.nominal
    assert nominal.placement.chosen.tolist() == finish(solve(problem)).chosen.tolist()
    for contender in (nominal, *study.robust):
        chosen = contender.placement.chosen
        drawn = draws_for(around, chosen, SCENARIOS.pose_errors, SCENARIOS.evaluated, SCENARIOS.seed + 1)
        views = finish(visibility_under_errors(around, chosen, drawn))
        expected = [views.seen(draw).any(axis=0).mean() for draw in range(SCENARIOS.evaluated)]
        assert contender.unseen == pytest.approx(expected, abs=1e-12)
        assert not problem.forbidden[chosen].any()


@pytest.mark.slow
def test_a_search_that_found_worse_than_the_nominal_optimum_is_not_followed(laid_out, monkeypatch):
    around, problem = laid_out
    worst = int(np.flatnonzero(problem.allowed)[problem.visible[problem.allowed].sum(axis=1).argmin()])

    def poor(problem, *_):
        yield Progress(0, 0, "searching badly")
        return replace(finish(solve(problem)), chosen=np.array([worst]), objective=0.0, status="feasible")

    monkeypatch.setattr("seip_addon.core.choosing.robustness.robust_study.solve_robust", poor)
    found = finish(robust_study(around, problem, SCENARIOS, [Risk(tail=0.0)], LIMITS))
    (contender,), (nominal,) = found.robust, found.nominal
    assert contender.placement.chosen.tolist() == nominal.placement.chosen.tolist()
    assert contender.placement.objective > 0
    assert found.saving(contender).value == 0


@pytest.mark.slow
def test_robustness_costs_what_was_planned(study):
    for contender in study.robust:
        assert study.price(contender) >= 0
        assert contender.placement.bound >= contender.placement.objective
    assert study.robust[1].placement.objective <= study.robust[0].placement.objective
    assert [row.method for row in robust_rows(study)] == [
        "placement for expected coverage",
        "placement for coverage in the worst scenario",
    ]


LOSSES = [Risk(failure="worst"), Risk(tail=0.5, failure="worst"), Risk(tail=0.0, failure="mean")]


@pytest.fixture(scope="module")
def study_of_losses(laid_out):
    return finish(robust_study(*laid_out, SCENARIOS, LOSSES, LIMITS))


@pytest.mark.slow
def test_who_was_chosen_for_a_loss_is_evaluated_by_that_loss_as_is_the_nominal_optimum(laid_out, study_of_losses):
    around, problem = laid_out

    def outcome(view, risk):
        assert len(view) == problem.count
        whole = (view.sum(axis=0) >= 1).mean()
        left = [(np.delete(view, gone, axis=0).sum(axis=0) >= 1).mean() for gone in range(len(view))]
        return {"none": whole, "worst": min(left), "mean": np.mean(left)}[risk.failure]

    @cache
    def looks(*chosen):
        poses = np.array(chosen)
        drawn = draws_for(around, poses, SCENARIOS.pose_errors, SCENARIOS.evaluated, SCENARIOS.seed + 1)
        return finish(visibility_under_errors(around, poses, drawn))

    for contender, risk in zip(study_of_losses.robust, LOSSES, strict=True):
        for evaluated in (contender, study_of_losses.beside(contender)):
            chosen = evaluated.placement.chosen
            views = looks(*chosen.tolist())
            expected = [outcome(views.seen(draw), risk) for draw in range(SCENARIOS.evaluated)]
            assert evaluated.unseen == pytest.approx(expected, abs=1e-12)
            assert evaluated.undisturbed == pytest.approx(outcome(problem.visible[chosen], risk), abs=1e-12)
        assert (contender.unseen < contender.planned).any()


@pytest.mark.slow
def test_it_says_what_is_compared(study, study_of_losses, tmp_path):
    low = study.robust[0].low.describe()
    assert f"5 % quantile of coverage {low} against" in robust_rows(study)[0].begins
    first, second, third, fourth = (row.begins for row in robust_rows(study_of_losses))
    assert "5 % quantile of coverage after the loss of the most important sensor" in first
    assert "5 % quantile of coverage by at least 2 sensors" in second
    assert "5 % quantile of coverage by at least 2 sensors" in third
    assert "5 % quantile of coverage after the loss of any one sensor, on average" in fourth
    assert len(study_of_losses.nominal) == 3  # two are evaluated alike
    save_spread_chart(tmp_path / "spread.png", study_of_losses, "spread")
    save_frontier_chart(tmp_path / "frontier.png", study_of_losses, "frontier")


def test_without_errors_robustness_is_free(laid_out):
    scenarios = Scenarios("pose-errors", PoseErrors(0.0, 0.0, 0.0, 0.0), count=2, held_out=2)
    study = finish(robust_study(*laid_out, scenarios, [Risk(tail=0.5)]))
    (robust,) = study.robust
    assert robust.placement.chosen.tolist() == study.nominal[0].placement.chosen.tolist()
    assert (robust.unseen == robust.planned).all()


def test_poses_of_one_place_err_alike(laid_out):
    around, _ = laid_out
    poses = np.arange(len(around.site.candidates))
    drawn = draws_for(around, poses, PoseErrors(), 2, 0)
    together = finish(visibility_under_errors(around, poses, drawn))
    some = np.array([3, 8])
    alone = draws_for(around, some, PoseErrors(), 2, 0)
    assert (finish(visibility_under_errors(around, some, alone)).packed == together.packed[:, some]).all()


@pytest.mark.slow
def test_charts_are_drawn(laid_out, study, tmp_path):
    around, problem = laid_out
    chosen = study.nominal[0].placement.chosen
    deployment = deploy(around.site, MODELS, problem.visible[chosen], chosen)
    evaluated = finish(pose_study(around, deployment, PoseStudySettings(PoseErrors(tilt=math.radians(5)), 10, 4)))
    save_spread_chart(tmp_path / "spread.png", study, "spread")
    save_frontier_chart(tmp_path / "frontier.png", study, "frontier")
    save_loss_chart(tmp_path / "blame.png", evaluated, "blame")
    for path in tmp_path.iterdir():
        assert imread(path).shape[1] > 1000
