"""Robust placements on held-out scenarios of pose errors."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.objective import Objective, placement_problem
from seip_addon.core.choosing.placement.risk import Risk
from seip_addon.core.choosing.placement.scenarios import Scenarios
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.robustness.robust_problem import RobustProblem
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scenarios.scenario_visibility import visibility_under_errors
from seip_addon.core.sensing.visibility.grid import VisibilitySettings, compute_visibility
from seip_addon.core.sensing.visibility.surroundings import Surroundings
from tests.builders.synthetic_junction import junction_site
from tests.engines import ANY

MODELS = load_catalogue()
SCENARIOS = Scenarios("pose-errors", count=4, held_out=20)
LIMITS = SolverLimits(effort=4.0)


@pytest.fixture(scope="module")
def laid_out():
    site = junction_site(positions=8, sensors=("type1", "type2"), heights=(5.4,), spacing=4.0)
    around = Surroundings(site, MODELS, VisibilitySettings(delta=2.0), engine=ANY)
    grid = finish(compute_visibility(site, MODELS, around.sight, ANY))
    goal = placement_problem(site, grid.visible, MODELS, Objective(count=2))
    return around, replace(goal, forbidden=site.candidates.sensor == "type2")


LOSSES = [Risk(failure="worst"), Risk(tail=0.5, failure="worst"), Risk(tail=0.0, failure="mean")]


@pytest.mark.slow
def test_placements_are_evaluated_by_the_outcome_they_were_chosen_for(laid_out):
    around, problem = laid_out
    robust = RobustProblem(around, problem, SCENARIOS)
    comparisons = finish(robust.compare(*finish(robust.placements(LOSSES, LIMITS))))
    assert comparisons[0].nominal is comparisons[1].nominal is not comparisons[2].nominal

    def outcome(view, risk):
        assert len(view) == problem.count
        whole = (view.sum(axis=0) >= 1).mean()
        left = [(np.delete(view, gone, axis=0).sum(axis=0) >= 1).mean() for gone in range(len(view))]
        return {"none": whole, "worst": min(left), "mean": np.mean(left)}[risk.failure]

    @cache
    def looks(*chosen):
        poses = np.array(chosen)
        sample = SCENARIOS.pose_errors, SCENARIOS.evaluated, SCENARIOS.seed + 1
        return finish(visibility_under_errors(around, poses, *sample))

    for comparison, risk in zip(comparisons, LOSSES, strict=True):
        for evaluated in (comparison.robust, comparison.nominal):
            chosen = evaluated.placement.chosen
            views = looks(*chosen.tolist())
            expected = [outcome(views.seen(draw), risk) for draw in range(SCENARIOS.evaluated)]
            assert evaluated.held_out == pytest.approx(expected, abs=1e-12)
            assert evaluated.nominal == pytest.approx(outcome(problem.amounts[chosen], risk), abs=1e-12)
        assert (comparison.robust.held_out < comparison.robust.planned).any()
