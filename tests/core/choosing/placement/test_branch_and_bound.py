"""Branch and bound against all feasible choices of small problems, whichever of its shortcuts are used."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement import branch_and_bound
from seip_addon.core.choosing.placement.branch_and_bound import BranchAndBound, GainSearch
from seip_addon.core.choosing.placement.incumbent import Incumbent
from seip_addon.core.choosing.placement.instance import make_instance
from seip_addon.core.choosing.placement.risk import Risk
from seip_addon.core.choosing.placement.search_limits import Work
from tests.builders.placement_problems import all_choices, random_problem
from tests.oracles.random_cases import cases

SHORTCUTS = {
    "usual": {},
    "few at once": {"MAX_PAIRS": 1},
    "no steps": {"ROOT_STEPS": 0, "NODE_STEPS": 0},
    "one stage": {"LEAST_GAP": 1.0},
}


@pytest.fixture(params=list(SHORTCUTS))
def _shortcuts(request, monkeypatch):
    for name, value in SHORTCUTS[request.param].items():
        monkeypatch.setattr(branch_and_bound, name, value)
    monkeypatch.setattr(branch_and_bound, "REPORTED", 1)


def poor_start(seed, *, returns=False, risk=None, shares=None):
    """Return the worst placement of a random problem as the incumbent, with the search and the best value."""
    number = seed
    while True:
        try:
            problem = random_problem(number, returns=returns)
            if risk is None:
                instance = make_instance(problem)
            else:
                changed = np.random.default_rng((3, number)).random((len(shares), *problem.amounts.shape)) < 0.2
                instance = make_instance(problem, list(problem.amounts ^ changed), risk)
        except SeipError:
            instance = None
        choices = all_choices(instance) if instance is not None else []
        if len(choices) > 1:
            break
        number += 1
    incumbent = Incumbent(instance, Work(math.inf))
    incumbent.offer(min(choices, key=instance.value))
    relaxed = instance.relaxed(np.ones(1) if shares is None else np.array(shares))
    return incumbent, BranchAndBound(incumbent, relaxed), max(map(instance.value, choices))


@pytest.mark.usefixtures("_shortcuts")
@cases(60)
@given(st.integers(0, 10**6), st.booleans())
def test_bound_holds_at_any_moment_and_ends_at_the_best_value(seed, returns):
    incumbent, search, best = poor_start(seed, returns=returns)
    slack = 2 * incumbent.instance.slack
    bounds = []
    for steps in (search.start(), search.run()):
        for _ in steps:
            assert incumbent.value <= best + slack
            assert incumbent.bound >= best - slack
            if bounds:
                assert search.bound >= best - slack
            block = incumbent.instance.blocks[0]
            assert incumbent.gap >= block.g.gap(incumbent.value, best, float(block.weight.sum())) - 1e-8
            if math.isfinite(incumbent.bound):
                bounds.append(incumbent.bound)
    assert bounds == sorted(bounds, reverse=True)
    assert incumbent.proven
    assert incumbent.value == pytest.approx(best, abs=slack)


@pytest.mark.usefixtures("_shortcuts")
@cases(20)
@given(st.integers(0, 10**6), st.booleans())
def test_a_search_that_was_stopped_can_go_on(seed, returns):
    incumbent, search, best = poor_start(seed, returns=returns)
    finish(search.start())
    for _ in range(10_000):
        incumbent.work = Work(1e-9)  # enough for one node
        if finish(search.run()):
            break
        assert not incumbent.proven
        assert max(incumbent.bound, incumbent.value) >= best - incumbent.instance.slack
        assert np.isin(incumbent.chosen, search.left()).all()
    assert incumbent.proven
    assert incumbent.value == pytest.approx(best, abs=2 * incumbent.instance.slack)


@pytest.mark.parametrize("at_once", [1, 4_000_000])
@cases(60)
@given(st.integers(0, 10**6), st.floats(0.0, 1.0))
def test_a_search_by_gains_finds_the_best_value_or_is_not_finished(at_once, seed, units):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(branch_and_bound, "MAX_PAIRS", at_once)
        incumbent, _, best = poor_start(seed)
        gains, every = GainSearch(incumbent, incumbent.instance.relaxed(np.ones(1))), np.arange(len(incumbent.instance))
        incumbent.work = Work(0.1 * units)
        assert finish(gains.run(every, 1.0)) == incumbent.proven
        incumbent.work = Work(math.inf)
        assert incumbent.proven or finish(gains.run(every, 1.0))
    assert incumbent.value == pytest.approx(best, abs=2 * incumbent.instance.slack)
    assert incumbent.bound == pytest.approx(best, abs=2 * incumbent.instance.slack)


@pytest.mark.usefixtures("_shortcuts")
@pytest.mark.parametrize(
    ("risk", "shares"),
    [
        (Risk(), [1 / 3, 1 / 3, 1 / 3]),
        (Risk(tail=0.5), [0.5, 0.2, 0.3]),
        (Risk(tail=0.0), [0.0, 1.0, 0.0]),
        (Risk(failure="worst"), [1.0]),
        (Risk(tail=0.0, failure="mean"), [0.6, 0.4]),
    ],
    ids=str,
)
def test_bound_over_scenarios_and_failures_holds(risk, shares):
    for seed in range(3):
        incumbent, search, best = poor_start(seed, risk=risk, shares=shares)
        if incumbent.instance.count < risk.least_sensors:
            continue
        finish(search.start())
        assert incumbent.bound >= best - incumbent.instance.slack
        finish(search.run())
        assert incumbent.proven
        assert incumbent.value == pytest.approx(best, abs=2 * incumbent.instance.slack)
