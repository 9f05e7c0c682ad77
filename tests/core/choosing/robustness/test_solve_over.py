"""Placements over scenarios of visibility, against all choices."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.instance import make_instance
from seip_addon.core.choosing.placement.risk import Risk
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.choosing.robustness.robust_problem import outcomes_of, solve_over
from seip_addon.core.sensing.scenarios.scenario_visibility import ScenarioVisibility
from tests.builders.placement_problems import all_choices, random_problem
from tests.oracles.random_cases import cases

RISKS = [Risk(), Risk(tail=0.4), Risk(tail=0.0), Risk(failure="worst"), Risk(tail=0.4, failure="mean")]


def packed(views):
    return ScenarioVisibility(np.packbits(views, axis=2), views.shape[2])


@pytest.mark.parametrize("risk", RISKS, ids=str)
@cases(60, 4)
@given(st.integers(0, 10**6))
def test_no_choice_is_better_and_without_effort_the_bound_holds(risk, seed):
    problem = random_problem(seed, count=3, mandatory=None, positions=np.arange(9))
    if problem.most_sensors < risk.least_sensors:
        return
    views = problem.amounts ^ (np.random.default_rng((5, seed)).random((5, *problem.amounts.shape)) < 0.2)
    scenarios = packed(views)
    instance = make_instance(problem, list(views), risk)
    measures = {
        tuple(one): risk.of(outcomes_of(problem, scenarios, risk, np.sort(instance.original[one])))
        for one in all_choices(instance)
    }
    best, slack = max(measures.values()), 2 * max(instance.slack * instance.unit, 1e-9)
    found = finish(solve_over(problem, scenarios, risk))
    assert (found.status, found.gap) == ("optimal", 0.0)
    assert found.objective == pytest.approx(best, abs=slack)
    assert found.objective == pytest.approx(risk.of(outcomes_of(problem, scenarios, risk, found.chosen)), abs=slack)
    short = finish(solve_over(problem, scenarios, risk, limits=SolverLimits(effort=1e-6)))
    assert short.objective <= best + slack
    assert short.bound >= best - slack


def test_equal_scenarios_are_one_and_a_known_placement_is_no_worse():
    problem = random_problem(11, count=3, mandatory=None)
    same = packed(np.stack([problem.amounts] * 7))
    nominal = finish(solve(problem))
    for risk in RISKS[:3]:
        over = finish(solve_over(problem, same, risk))
        assert (over.objective, over.chosen.tolist()) == (nominal.objective, nominal.chosen.tolist())
    views = problem.amounts ^ (np.random.default_rng(6).random((5, *problem.amounts.shape)) < 0.2)
    known = finish(solve_over(problem, packed(views), RISKS[1]))
    again = finish(solve_over(problem, packed(views), RISKS[1], known.chosen, SolverLimits(effort=1e-6)))
    assert again.objective >= known.objective
