"""What placements hold in traffic, where road users are, and the charts of both."""

import math
from dataclasses import replace

from headless.charts.traffic import negative, save_time_map, save_traffic_chart
from headless.studies.stability.robustness_rows import traffic_rows

import numpy as np
import pytest
from matplotlib.image import imread

from seip_addon.core.choosing.placement.deployment import deploy
from seip_addon.core.choosing.placement.objective import Objective, placement_problem
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.choosing.robustness.robust_placement import at_least
from seip_addon.core.choosing.robustness.traffic_instants import NO_TRAFFIC, spread_instants
from seip_addon.core.choosing.robustness.traffic_study import traffic_scenarios, traffic_study
from seip_addon.core.choosing.robustness.visibility_in_traffic import visibility_in_traffic
from seip_addon.core.estimates import IntervalEstimate, mean_of, mean_over_time
from seip_addon.core.progress import finish
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.traffic.trajectories import RoadUser
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.surroundings import Surroundings
from tests.builders.small_junction import make_geometry
from tests.builders.synthetic_junction import junction_site
from tests.builders.traffic_by_hand import make_trajectories, parked
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
    return scenarios, finish(traffic_study(around, problem, scenarios, spread_instants([queue(3)], 8, 1)))


def test_the_empty_road_is_where_both_begin(laid_out, study):
    around, problem = laid_out
    scenarios, found = study
    assert (scenarios.empty[problem.allowed] == problem.visible[problem.allowed]).all()
    assert not scenarios.empty[problem.forbidden].any()
    static = finish(solve(replace(problem, visible=scenarios.empty)))
    assert found.empty.placement.chosen.tolist() == static.chosen.tolist()
    assert found.empty.seen.empty == pytest.approx(static.covered / len(around.site.targets))


@pytest.mark.slow
def test_both_are_evaluated_at_instants_that_nothing_was_chosen_on(laid_out, study):
    around, _ = laid_out
    _, found = study
    evaluated = spread_instants([queue(3)], 8, 1)
    for placed in (found.empty, found.traffic):
        seen, views = placed.seen, finish(visibility_in_traffic(around, placed.placement.chosen, evaluated.obstacles()))
        rows = np.array([views.seen(instant).any(axis=0) for instant in range(8)])
        assert seen.at == pytest.approx(rows.mean(axis=1), abs=1e-12)
        assert seen.time == pytest.approx(rows.mean(axis=0), abs=1e-12)
        assert seen.hidden_at == pytest.approx((seen.empty_targets & ~rows).mean(axis=1), abs=1e-12)
        assert seen.hidden.value == pytest.approx(seen.hidden_at.mean() / seen.empty, abs=1e-12)
        assert seen.hidden.value * seen.empty >= seen.loss.value - 1e-12


def test_on_the_instants_that_it_was_chosen_on_it_loses_to_none(laid_out, study):
    around, problem = laid_out
    scenarios, found = study
    instants = spread_instants([queue(1), queue(2)], 6, 0)
    assert (scenarios.views.packed[0] == look(around, problem, instants.of(np.array([0])))).all()

    def mean(placed):
        return scenarios.views.seen_by_any(placed.placement.chosen).mean()

    assert mean(found.traffic) >= mean(found.empty) - 1e-12
    assert found.traffic.placement.objective == pytest.approx(mean(found.traffic) * len(around.site.targets))


def look(around, problem, instants):
    return finish(traffic_scenarios(around, problem, instants)).views.packed[0]


def test_it_says_what_traffic_hides(study):
    _, found = study
    seen = found.empty.seen
    costly = replace(seen, at=np.full_like(seen.at, seen.empty - 0.02))
    costly = replace(found, empty=replace(found.empty, seen=costly))
    assert any("2.0% less" in sentence for sentence in costly.messages())
    nothing = replace(seen, at=np.full_like(seen.at, seen.empty - 0.004))
    quiet = replace(found, empty=replace(found.empty, seen=nothing))
    quiet = replace(quiet, traffic=quiet.empty)
    assert quiet.messages()[1:] == ()
    other = replace(found.traffic, placement=replace(found.traffic.placement, chosen=np.array([0, 1])))
    doubtful = replace(quiet, traffic=replace(other, seen=quiet.empty.seen))
    assert ["not significantly better" in sentence for sentence in doubtful.messages()[1:]] == [True]
    better = replace(nothing, at=nothing.at + 0.1)
    gains = replace(quiet, traffic=replace(other, seen=better))
    assert gains.messages()[1:] == ()
    rows = traffic_rows(found)
    assert "24 road users at a time" in rows[0].regime
    assert f"vehicles hide {seen.hidden.describe()}" in rows[0].begins
    assert f", {found.gain.as_change()}" in rows[1].begins


def test_a_result_that_is_worse_in_traffic_is_called_worse(study):
    _, found = study
    worse = replace(found.empty.seen, at=found.empty.seen.at - 0.0071)
    message = replace(found, traffic=replace(found.traffic, seen=worse)).messages()[0]
    assert "this placement sees 0.71 points [" in message
    assert "] less of the road than the best placement for the empty road" in message
    assert "-0.71" not in message


def test_a_search_cut_short_returns_nothing_worse_than_the_placement_for_the_empty_road(study):
    _, found = study
    short = replace(found.traffic.placement, objective=10.0, bound=16.0, gap=0.6, status="feasible")
    other = replace(found.empty.placement, chosen=np.array([3, 5]), covered=7.0, price=8.0)
    assert at_least(short, other, 10.0) is short
    better = at_least(short, other, 12.0)
    assert (better.chosen.tolist(), better.objective, better.bound) == ([3, 5], 12.0, 16.0)
    assert (better.gap, better.covered, better.price, better.status) == (pytest.approx(1 / 3), 7.0, 8.0, "feasible")


@pytest.mark.slow
def test_without_anyone_on_the_road_nothing_is_lost(laid_out):
    around, problem = laid_out
    runs = [parked((0.0, 3000.0, 0.0, 0.0, 0.0))]  # somewhere else
    scenarios = finish(traffic_scenarios(around, problem, spread_instants(runs, 2, 0)))
    found = finish(traffic_study(around, problem, scenarios, spread_instants(runs, 8, 1)))
    assert found.empty.placement.chosen.tolist() == found.traffic.placement.chosen.tolist()
    assert (found.empty.seen.at == found.empty.seen.empty).all()
    assert found.empty.seen.rarely_seen == 0.0
    assert found.messages()[1:] == ()
    assert (scenarios.views.seen(0) == finish(visibility_in_traffic(around, np.arange(16), [NO_TRAFFIC])).seen(0))[
        problem.allowed
    ].all()


def test_instants_near_in_time_count_once():
    random = np.random.default_rng(0)
    batch = np.repeat(np.arange(12), 20)
    values = random.normal(size=12)[batch] + 0.01 * random.normal(size=240)
    honest, naive = mean_over_time(values, batch), mean_of(values)
    assert honest.value == pytest.approx(naive.value)
    assert 3.0 < (honest.high - honest.low) / (naive.high - naive.low) < 6.0
    assert mean_over_time(values[:60], batch[:60]) == IntervalEstimate(math.fsum(values[:60]) / 60, -math.inf, math.inf)
    assert negative(IntervalEstimate(1.0, -2.0, 3.0)) == IntervalEstimate(-1.0, -3.0, 2.0)


def test_the_interval_of_few_stretches_holds_as_often_as_it_says():
    random = np.random.default_rng(1)
    estimates = [mean_over_time(random.normal(size=5), np.arange(5)) for _ in range(2000)]
    assert np.mean([each.low <= 0.0 <= each.high for each in estimates]) == pytest.approx(0.95, abs=0.015)


@pytest.mark.slow
def test_charts_are_drawn_and_the_same_twice(tmp_path, laid_out, study):
    around, problem = laid_out
    _, found = study
    chosen = found.traffic.placement.chosen
    deployment = deploy(around.site, MODELS, problem.visible[chosen], chosen)
    for name in ("one.png", "two.png"):
        save_time_map(tmp_path / name, make_geometry(80.0), around.site, deployment, found.traffic, "A title")
        save_traffic_chart(tmp_path / f"chart {name}", found, "2 × a", "A title")
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "two.png").read_bytes()
    assert (tmp_path / "chart one.png").read_bytes() == (tmp_path / "chart two.png").read_bytes()
    assert imread(tmp_path / "one.png")[..., :3].std() > 0.05
