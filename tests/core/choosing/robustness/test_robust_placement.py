"""Placements under risk, against exhaustive search over all subsets."""

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from seip_addon.core.choosing.placement.bounds import lagrangian_bound
from seip_addon.core.choosing.placement.problem import PlacementProblem
from seip_addon.core.choosing.placement.reduced_problem import make_instance
from seip_addon.core.choosing.placement.risk import Risk
from seip_addon.core.choosing.placement.search_limits import Clock, SolverLimits
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.choosing.robustness.robust_placement import solve_robust
from seip_addon.core.choosing.robustness.robust_search import BestUnderRisk
from seip_addon.core.choosing.robustness.scenario_visibility import ScenarioVisibility
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
from tests.few import few
from tests.oracles.placement_oracle import all_placements, covered, small_problems
from tests.oracles.random_cases import cases

RISKS = [
    Risk(),
    Risk(tail=0.5),
    Risk(tail=0.3),
    Risk(tail=0.0),
    Risk(failure="worst"),
    Risk(failure="mean"),
    Risk(tail=0.0, failure="mean"),
    Risk(tail=0.3, failure="worst"),
]


def pack(views):
    return ScenarioVisibility(np.packbits(views, axis=2), views.shape[2])


@st.composite
def under_risk(draw, risks=RISKS):
    problem = draw(small_problems())
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    flips = rng.random((draw(st.integers(1, 4)), *problem.visible.shape)) < draw(st.sampled_from([0.1, 0.3]))
    views = problem.visible ^ flips
    views[:, 0] |= problem.visible[0]
    possible = [risk for risk in risks if risk.least_sensors <= problem.most_sensors]
    assume(possible and all_placements(problem))
    return problem, views, draw(st.sampled_from(possible))


def by_hand(problem, views, risk, choice):
    """The objective in plain Python, from its definition."""

    def weight_seen(view, sensors):
        times = [sum(bool(view[i, j]) for i in sensors) for j in range(view.shape[1])]
        return sum(w for w, n in zip(problem.weights, times, strict=True) if n >= 1)

    outcomes = []
    for view in views:
        whole = weight_seen(view, choice)
        left = [weight_seen(view, [i for i in choice if i != gone]) for gone in choice] or [0.0]
        spare = problem.most_sensors - len(choice)  # sensors that may fail without being missed
        mean = (sum(left) + spare * whole) / problem.most_sensors if choice else 0.0
        outcomes.append({"none": whole, "worst": min(left), "mean": mean}[risk.failure])
    counted = max(1, math.ceil(risk.tail * len(outcomes) - 1e-9))
    return sum(sorted(outcomes)[:counted]) / counted


@given(under_risk())
@cases(150)
def test_no_subset_is_better(case):
    problem, views, risk = case
    answer = finish(solve_robust(problem, pack(views), risk))
    best = max(by_hand(problem, views, risk, choice) for choice in all_placements(problem))
    choice = tuple(answer.chosen.tolist())
    assert sorted(choice) in [sorted(one) for one in all_placements(problem)]
    assert answer.objective == pytest.approx(best, abs=1e-7)
    assert by_hand(problem, views, risk, choice) == pytest.approx(best, abs=1e-7)
    assert answer.status == "optimal"
    assert answer.bound == pytest.approx(best, abs=1e-7)
    assert answer.covered == pytest.approx(covered(problem, choice))


def crowd(seed, count):
    """Return a problem in which few pairs see much together, and views of two scenarios."""
    rng = np.random.default_rng(seed)
    at, targets = rng.random((16, 2)), rng.random((60, 2))
    views = np.linalg.norm(at[:, None] - targets, axis=2) < rng.uniform(0.2, 0.4, (2, 16, 1))
    problem = PlacementProblem(
        visible=views[0],
        weights=rng.integers(1, 4, 60).astype(float),
        prices=np.ones(16),
        positions=np.arange(16) // 2 * 2,
        xyz=np.column_stack([at, np.zeros(16)]),
        labels=np.array([f"type{i}" for i in range(16)]),
        count=count,
    )
    return problem, views


def reached_at_most(problem, views, risk):
    """T of the best of all placements."""
    seen = views.astype(np.uint8)
    choices = (list(c) for k in range(problem.count + 1) for c in combinations(range(16), k))
    apart = (c for c in choices if len({problem.positions[i] for i in c}) == len(c))
    return max(risk.of(risk.outcomes(seen[:, c], problem.weights, problem.count)) for c in apart)


@pytest.mark.parametrize("risk", few(RISKS, 4))
@pytest.mark.parametrize("count", [4, 5])
def test_no_placement_is_better_where_branches_are_many(risk, count):
    problem, views = crowd(3, count)
    answer = finish(solve_robust(problem, pack(views), risk))
    assert answer.objective == pytest.approx(reached_at_most(problem, views, risk))
    assert answer.status == "optimal"
    assert answer.gap == 0


@pytest.mark.parametrize("risk", few(RISKS, 3))
def test_without_time_the_bound_still_holds(risk, monkeypatch):
    monkeypatch.setattr("seip_addon.core.choosing.robustness.robust_placement.MIN_SECONDS", 1e-6)
    for seed in range(4):
        problem, views = crowd(seed, 4)
        answer = finish(solve_robust(problem, pack(views), risk, SolverLimits(time_limit=1e-6)))
        best = reached_at_most(problem, views, risk)
        assert answer.objective <= best + 1e-9
        assert answer.bound >= best - 1e-9
        assert answer.status == "optimal" or any("search ended" in note for note in answer.notes)


@pytest.mark.parametrize("risk", [Risk(failure="mean"), Risk(failure="worst")])
@pytest.mark.parametrize("waiting", [10_000, 3])
def test_the_bound_only_falls_and_never_below_what_can_be_reached(risk, waiting, monkeypatch):
    monkeypatch.setattr("seip_addon.core.choosing.placement.branch_and_bound.MAX_WAITING_FOLLOWERS", waiting)
    problem, views = crowd(7, 5)
    instance, scale = make_instance(problem)
    instance = replace(instance, cover=risk.cover(5))
    best = reached_at_most(problem, views[:1], risk)

    def evaluate(chosen):
        seen = views[:1, instance.original[chosen]].astype(np.uint8)
        return risk.of(risk.outcomes(seen, problem.weights, 5))

    start = np.zeros(0, dtype=np.int64)
    root = finish(lagrangian_bound(instance, 0.0, Clock(math.inf)))

    def searched(branches):
        search = BestUnderRisk(instance, scale * instance.cover.unit, evaluate, start, 1e-9, root)
        finished = finish(search.run(Clock(math.inf), math.inf, branches))
        return search, finished

    found = [searched(branches) for branches in (0, 1, 2, 4, 8, 16, 32, 64, 128, 100_000)]
    bounds = [search.bound for search, _ in found]
    assert bounds == sorted(bounds, reverse=True)
    assert bounds[0] > bounds[-1]
    assert all(search.value <= best * (1 + 1e-12) and search.bound >= best * (1 - 1e-12) for search, _ in found)
    last, finished = found[-1]
    assert finished
    assert last.value == pytest.approx(best)
    assert last.bound == pytest.approx(best)


@pytest.mark.slow
@given(under_risk(risks=[Risk()]))
@cases(40, 10)
def test_worst_is_below_tail_is_below_expectation(case):
    problem, views, _ = case
    worst, tail, mean = (finish(solve_robust(problem, pack(views), Risk(tail=share))) for share in (0.0, 0.5, 1.0))
    assert worst.objective <= tail.objective + 1e-9
    assert tail.objective <= mean.objective + 1e-9
    assert mean.objective <= mean.bound + 1e-9


@given(small_problems(), st.sampled_from(RISKS[:4]))
@cases(40, 12)
def test_without_errors_it_is_the_nominal_answer(problem, risk):
    assume(all_placements(problem))
    nominal = finish(solve(problem))
    robust = finish(solve_robust(problem, pack(np.stack([problem.visible] * 3)), risk))
    assert robust.chosen.tolist() == nominal.chosen.tolist()
    assert robust.objective == nominal.objective
    assert robust.bound == nominal.bound


@given(under_risk(), st.randoms(use_true_random=False))
@cases(60, 15)
def test_the_order_of_candidates_does_not_matter(case, random):
    problem, views, risk = case
    order = list(range(len(problem.visible)))
    random.shuffle(order)
    shuffled = replace(
        problem,
        visible=problem.visible[order],
        prices=problem.prices[order],
        positions=problem.positions[order],
        xyz=problem.xyz[order],
        labels=problem.labels[order],
        mandatory=problem.mandatory[:, order],
        forbidden=problem.forbidden[order],
    )
    one = finish(solve_robust(problem, pack(views), risk))
    other = finish(solve_robust(shuffled, pack(views[:, order]), risk))
    assert sorted(np.array(order)[other.chosen].tolist()) == sorted(one.chosen.tolist())
    assert one.objective == pytest.approx(other.objective, abs=1e-9)


@pytest.mark.parametrize("failure", ["none", "worst", "mean"])
@pytest.mark.parametrize("sensors", [2, 5])
def test_the_value_of_a_target_bounds_what_a_failure_leaves_and_is_concave(failure, sensors):
    cover = Risk(failure=failure).cover(sensors)
    times = np.arange(sensors + 1)
    steps = cover.increment(times)
    assert (np.diff(steps) <= 0).all()
    assert (cover.increment(times, 1) == cover.increment(times + 1)).all()
    for seen in times:
        for used in range(max(seen, 1), sensors + 1):
            left = float(seen >= 1) if failure == "none" else 1 - 1 / used if seen == 1 else float(seen > 1)
            assert cover.value(seen) / cover.unit >= left - 1e-12


def test_too_few_sensors_are_refused():
    problem = PlacementProblem(
        visible=np.eye(2, dtype=bool),
        weights=np.ones(2),
        prices=np.ones(2),
        positions=np.arange(2),
        xyz=np.array([[0.0, 0, 0], [1, 0, 0]]),
        labels=np.array(["a", "a"]),
        count=1,
    )
    with pytest.raises(SeipError, match="at least 2 sensors"):
        finish(solve_robust(problem, pack(problem.visible[None]), Risk(failure="worst")))


def test_whole_weights_are_compared_exactly_under_failures():
    weights = np.array([2.0**32, 1.0])
    sees = np.array([[1, 0], [1, 1], [0, 1]], dtype=bool)
    problem = PlacementProblem(
        visible=sees,
        weights=weights,
        prices=np.ones(3),
        positions=np.arange(3),
        xyz=np.column_stack([np.arange(3.0), np.zeros((3, 2))]),
        labels=np.full(3, "type1"),
        count=3,
    )
    for risk in (Risk(failure="worst"), Risk(failure="worst", tail=0.5)):
        answer = finish(solve_robust(problem, pack(np.stack([sees, sees])), risk))
        assert (answer.objective, len(answer.chosen)) == (2.0**32 + 1, 3)  # the third sensor adds one unit of weight


def test_ties_of_weights_without_a_common_unit_are_those_within_the_tolerance_of_the_best():
    problem, _ = crowd(1, 5)
    instance, _ = make_instance(problem)
    root = finish(lagrangian_bound(instance, 0.0, Clock(math.inf)))
    ones = [choice for choice in combinations(range(len(instance)), 3) if instance.feasible(np.array(choice))]
    three, two, four = (
        ones[0],
        ones[0][:2],
        next((*ones[0], last) for last in range(len(instance)) if instance.feasible(np.unique((*ones[0], last)))),
    )
    values = {tuple(sorted(choice)): value for choice, value in ((three, 10.0), (two, 9.1), (four, 10.5))}
    search = BestUnderRisk(instance, 1.0, lambda choice: values[tuple(choice.tolist())], np.array(three), 1.0, root)
    for choice in (two, four):  # the first ties with the one before, not with the best
        search.offer(np.array(choice))
    assert (tuple(search.best), search.value, search.goal) == (three, 10.0, 9.5)
