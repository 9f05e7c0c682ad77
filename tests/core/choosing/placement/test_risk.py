"""Risk measures of outcomes in scenarios, and after the failure of a sensor."""

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.risk import Risk
from seip_addon.core.choosing.placement.solver import solve
from tests.builders.placement_problems import row_problem

OUTCOMES = np.array([4.0, 1.0, 3.0, 2.0, 5.0])
RISKS = [(Risk(), 3.0), (Risk(tail=0.4), 1.5), (Risk(tail=0.41), 2.0), (Risk(tail=0.0), 1.0)]


@pytest.mark.parametrize(("risk", "measure"), RISKS, ids=str)
def test_measure_is_the_mean_of_the_worst_share(risk, measure):
    assert risk.of(OUTCOMES) == pytest.approx(measure)
    columns = np.stack([OUTCOMES, OUTCOMES[::-1] + 1.0], axis=1)
    assert risk.of_each(columns) == pytest.approx([measure, measure + 1.0])
    assert OUTCOMES[risk.worst(OUTCOMES)].mean() == pytest.approx(measure)


@pytest.mark.parametrize(("failure", "outcome"), [("none", 10.0), ("worst", 3.0), ("mean", 6.25)])
def test_outcome_after_a_failure(failure, outcome):
    """Three sensors see weights 1, 2 and 7; the first two see the 1, and a fourth sensor would be allowed."""
    weight = np.array([1.0, 2.0, 7.0])
    seen = np.array([[[1, 0, 0], [1, 1, 0], [0, 0, 1]]], dtype=np.uint8)
    assert Risk(failure=failure).outcomes(seen, weight, 4) == pytest.approx([outcome + (failure == "mean") * 1.5])
    nothing = Risk(failure=failure).outcomes(seen[:, :0], weight, 4)
    assert nothing == pytest.approx([0.0])


@pytest.mark.parametrize("failure", ["worst", "mean"])
def test_one_sensor_that_may_fail_is_refused(failure):
    with pytest.raises(SeipError, match="at least 2 sensors"):
        finish(solve(row_problem(count=1), risk=Risk(failure=failure)))


def test_scenarios_choose_between_mean_and_worst():
    """Of three poses one sees much in most scenarios, one something in all of them."""
    cases = [np.array([[1, 1, 1, 0], [0, 0, 1, 1], [0, 0, 0, 1]], bool) for _ in range(4)]
    cases[3] = np.array([[0, 0, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1]], bool)
    problem = row_problem(cases[0], count=1)
    mean, worst = (finish(solve(problem, cases=cases, risk=Risk(tail=tail))) for tail in (1.0, 0.0))
    assert (mean.chosen.tolist(), mean.objective, mean.status) == ([0], 2.25, "optimal")
    assert (worst.chosen.tolist(), worst.objective, worst.status) == ([1], 2.0, "optimal")
