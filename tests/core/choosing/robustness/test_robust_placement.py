"""Placements under risk, against exhaustive search over all subsets."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from seip_addon.core.choosing.placement.problem import PlacementProblem
from seip_addon.core.choosing.placement.risk import Risk
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.robustness.robust_placement import solve_robust
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
from seip_addon.core.sensing.scenarios.scenario_visibility import ScenarioVisibility
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


@given(under_risk())
@cases(40)
def test_without_time_the_bound_still_holds(case):
    problem, views, risk = case
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("seip_addon.core.choosing.robustness.robust_placement.MIN_SECONDS", 1e-6)
        answer = finish(solve_robust(problem, pack(views), risk, SolverLimits(time_limit=1e-6)))
    best = max(by_hand(problem, views, risk, choice) for choice in all_placements(problem))
    assert answer.objective <= best + 1e-7
    assert answer.bound >= best - 1e-7
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
