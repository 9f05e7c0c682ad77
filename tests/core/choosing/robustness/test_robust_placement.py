"""Placements under risk, against exhaustive search over all subsets."""

import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from seip_addon.core.choosing.placement.problem import PlacementProblem
from seip_addon.core.choosing.placement.risk import Risk
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.robustness.robust_placement import solve_robust
from seip_addon.core.choosing.robustness.scenario_visibility import ScenarioVisibility
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
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


@pytest.mark.parametrize("risk", [Risk(tail=0.5), Risk(failure="worst")])
def test_without_time_the_bound_still_holds(risk, monkeypatch):
    monkeypatch.setattr("seip_addon.core.choosing.robustness.robust_placement.MIN_SECONDS", 1e-6)
    for seed in range(4):
        problem, views = crowd(seed, 4)
        answer = finish(solve_robust(problem, pack(views), risk, SolverLimits(time_limit=1e-6)))
        best = reached_at_most(problem, views, risk)
        assert answer.objective <= best + 1e-9
        assert answer.bound >= best - 1e-9
        assert answer.status == "optimal" or any("search ended" in note for note in answer.notes)


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
