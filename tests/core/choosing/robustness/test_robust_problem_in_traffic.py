"""Placements for the empty road and for traffic, evaluated at held-out instants."""

import math
from dataclasses import replace

from headless.studies.stability.robustness_rows import hidden, traffic_rows

import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.objective import Objective, placement_problem
from seip_addon.core.choosing.placement.risk import Risk
from seip_addon.core.choosing.placement.scenarios import Scenarios
from seip_addon.core.choosing.robustness.robust_problem import RobustProblem
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scenarios.scenario_visibility import visibility_in_traffic
from seip_addon.core.sensing.scenarios.traffic_instants import spread_instants
from seip_addon.core.sensing.traffic.trajectories import RoadUser
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.surroundings import Surroundings
from tests.builders.synthetic_junction import junction_site
from tests.builders.traffic_by_hand import make_trajectories
from tests.engines import ANY, needs_any

pytestmark = needs_any

MODELS = {key: replace(model, points_per_second=model.points_per_second / 6) for key, model in load_catalogue().items()}
BUS = RoadUser("bus", "bus", 12.0, 2.5, 3.2)


def queue(seed, *, end=60.0):
    """Buses in all lanes, each moving straight on slowly."""
    random = np.random.default_rng(seed)
    ways = []
    for lane in (-5.0, -2.0, 2.0, 5.0):
        for start in random.uniform(-60, 60, 3):
            far = start + random.uniform(-25, 25)
            ways.append([(0.0, start, lane, 0, 0, 0), (end, far, lane, 0, 0, 0)])
            ways.append([(0.0, lane, start, 0, math.pi / 2, 0), (end, lane, far, 0, math.pi / 2, 0)])
    return make_trajectories(*ways, users=[replace(BUS, name=f"bus {n}") for n in range(len(ways))])


@pytest.fixture(scope="module")
def laid_out():
    site = junction_site(positions=8, sensors=("hdl32e", "vlp16"), heights=(3.5,), spacing=4.0)
    around = Surroundings(site, MODELS, VisibilitySettings(delta=2.0), engine=ANY)
    grid = finish(compute_visibility(site, MODELS, around.sight, ANY))
    problem = placement_problem(site, grid.visible, MODELS, Objective(count=2))
    return around, replace(problem, forbidden=site.candidates.sensor == "hdl32e")


@pytest.fixture(scope="module")
def comparison(laid_out):
    scenarios = Scenarios("traffic", count=6, held_out=8)
    robust = RobustProblem(*laid_out, scenarios, ([queue(1), queue(2)], [queue(3)]))
    return finish(robust.compare(*finish(robust.placements([Risk()]))))[0]


@pytest.mark.slow
def test_both_are_evaluated_at_instants_that_nothing_was_chosen_on(laid_out, comparison):
    around, problem = laid_out
    evaluated = spread_instants([queue(3)], 8, 1)
    for placed in (comparison.nominal, comparison.robust):
        chosen = placed.placement.chosen
        views = finish(visibility_in_traffic(around, chosen, evaluated.obstacles()))
        rows = np.array([views.seen(instant).any(axis=0) for instant in range(8)])
        empty = problem.amounts[chosen].any(axis=0)
        assert (placed.seen == [empty, *rows]).all()
        assert placed.held_out == pytest.approx(rows.mean(axis=1), abs=1e-12)
        assert placed.nominal == pytest.approx(empty.mean(), abs=1e-12)
        assert hidden(placed).value == pytest.approx((empty & ~rows).mean() / placed.nominal, abs=1e-12)
        assert hidden(placed).value * placed.nominal >= placed.loss.value - 1e-12


def test_on_the_instants_that_it_was_chosen_on_it_loses_to_none(laid_out, comparison):
    around, _ = laid_out
    instants = spread_instants([queue(1), queue(2)], 6, 0)

    def mean(placed):
        views = finish(visibility_in_traffic(around, placed.placement.chosen, instants.obstacles()))
        return views.seen_by_any(np.arange(2)).mean()

    robust = comparison.robust
    assert mean(robust) >= mean(comparison.nominal) - 1e-12
    assert robust.placement.objective == pytest.approx(mean(robust) * len(around.site.targets))


def test_it_says_what_traffic_hides(comparison):
    seen = comparison.nominal
    costly = replace(comparison, nominal=replace(seen, held_out=np.full_like(seen.held_out, seen.nominal - 0.02)))
    assert any("2.0% less" in sentence for sentence in costly.messages())
    nothing = replace(seen, held_out=np.full_like(seen.held_out, seen.nominal - 0.004))
    quiet = replace(comparison, nominal=nothing, robust=nothing)
    assert quiet.messages()[1:] == ()
    other = replace(nothing, placement=replace(comparison.robust.placement, chosen=np.array([0, 1])))
    doubtful = replace(quiet, robust=other)
    assert ["not significantly better" in sentence for sentence in doubtful.messages()[1:]] == [True]
    gains = replace(quiet, robust=replace(other, held_out=nothing.held_out + 0.1))
    assert gains.messages()[1:] == ()
    rows = traffic_rows(comparison)
    assert "24 road users at a time" in rows[0].regime
    assert f"vehicles hide {hidden(seen).describe()}" in rows[0].begins
    assert f", {comparison.gain.as_change()}" in rows[1].begins
