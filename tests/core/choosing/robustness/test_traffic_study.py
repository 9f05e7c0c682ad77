"""Placements for the empty road and for traffic, evaluated at held-out instants."""

import math
from dataclasses import replace

from headless.studies.stability.robustness_rows import traffic_rows

import numpy as np
import pytest

from seip_addon.core.choosing.placement.objective import Objective, placement_problem
from seip_addon.core.choosing.robustness.traffic_study import traffic_placements, traffic_scenarios, traffic_study
from seip_addon.core.progress import finish
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scenarios.traffic_instants import spread_instants
from seip_addon.core.sensing.scenarios.visibility_in_traffic import visibility_in_traffic
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
def study(laid_out):
    around, problem = laid_out
    scenarios = finish(traffic_scenarios(around, problem, spread_instants([queue(1), queue(2)], 6, 0)))
    placements = finish(traffic_placements(problem, scenarios))
    return scenarios, finish(traffic_study(around, problem, placements, 6, spread_instants([queue(3)], 8, 1)))


@pytest.mark.slow
def test_both_are_evaluated_at_instants_that_nothing_was_chosen_on(laid_out, study):
    around, _ = laid_out
    _, found = study
    evaluated = spread_instants([queue(3)], 8, 1)
    for placed in (found.empty, found.traffic):
        views = finish(visibility_in_traffic(around, placed.placement.chosen, evaluated.obstacles()))
        rows = np.array([views.seen(instant).any(axis=0) for instant in range(8)])
        assert placed.at == pytest.approx(rows.mean(axis=1), abs=1e-12)
        assert placed.time == pytest.approx(rows.mean(axis=0), abs=1e-12)
        assert placed.hidden_at == pytest.approx((placed.empty_targets & ~rows).mean(axis=1), abs=1e-12)
        assert placed.hidden.value == pytest.approx(placed.hidden_at.mean() / placed.empty, abs=1e-12)
        assert placed.hidden.value * placed.empty >= placed.loss.value - 1e-12


def test_on_the_instants_that_it_was_chosen_on_it_loses_to_none(laid_out, study):
    around, problem = laid_out
    scenarios, found = study
    instants = spread_instants([queue(1), queue(2)], 6, 0)
    assert (scenarios.packed[1] == look(around, problem, instants.of(np.array([0])))).all()

    def mean(placed):
        return scenarios.seen_by_any(placed.placement.chosen)[1:].mean()

    assert mean(found.traffic) >= mean(found.empty) - 1e-12
    assert found.traffic.placement.objective == pytest.approx(mean(found.traffic) * len(around.site.targets))


def look(around, problem, instants):
    return finish(traffic_scenarios(around, problem, instants)).packed[1]


def test_it_says_what_traffic_hides(study):
    _, found = study
    seen = found.empty
    costly = replace(found, empty=replace(seen, at=np.full_like(seen.at, seen.empty - 0.02)))
    assert any("2.0% less" in sentence for sentence in costly.messages())
    nothing = replace(seen, at=np.full_like(seen.at, seen.empty - 0.004))
    quiet = replace(found, empty=nothing, traffic=nothing)
    assert quiet.messages()[1:] == ()
    other = replace(nothing, placement=replace(found.traffic.placement, chosen=np.array([0, 1])))
    doubtful = replace(quiet, traffic=other)
    assert ["not significantly better" in sentence for sentence in doubtful.messages()[1:]] == [True]
    gains = replace(quiet, traffic=replace(other, at=nothing.at + 0.1))
    assert gains.messages()[1:] == ()
    rows = traffic_rows(found)
    assert "24 road users at a time" in rows[0].regime
    assert f"vehicles hide {seen.hidden.describe()}" in rows[0].begins
    assert f", {found.gain.as_change()}" in rows[1].begins
