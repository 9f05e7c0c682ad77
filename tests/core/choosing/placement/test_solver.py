"""Placements: reasons why there is none, what they depend on, reports, acceptance and notes."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.acceptance import Acceptance
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Pace, finish
from seip_addon.core.choosing.placement.concave import LOG_RETURNS
from seip_addon.core.choosing.placement.risk import Risk
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.placement.solver import UNPROVEN, solve, solve_greedy
from tests.builders.placement_problems import HALVES, hard_problem, random_problem, row_problem
from tests.oracles.random_cases import cases

FIRST_TWO = np.array([[1, 0, 0, 0], [0, 1, 0, 0]], bool)
SHORT = SolverLimits(effort=0.1)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"count": 5}, "only 4 positions"),
        ({"count": 0}, "it must be at least 1"),
        ({"budget": 5000.0}, "costs 6000"),
        ({"weights": np.array([1.0, np.nan, 1.0, 1.0])}, "weight"),
        ({"weights": np.zeros(4)}, "weight of every target is 0"),
        ({"prices": np.array([1.0, np.inf, 1.0, 1.0])}, "price"),
        ({"forbidden": np.ones(4, bool)}, "every candidate is forbidden"),
        ({"min_distance": -1.0}, "finite distance of at least 0"),
        ({"mandatory": FIRST_TWO, "mandatory_names": np.array(["A", "B"]), "forbidden": FIRST_TWO[1]}, "B must carry"),
        ({"mandatory": FIRST_TWO, "count": 1}, r"\(mandatory group 1, mandatory group 2\) .* allow at least 2 or"),
        ({"mandatory": FIRST_TWO, "budget": 6000.0}, "raise it to at least 12000"),
        ({"mandatory": FIRST_TWO, "min_distance": 15.0}, "at least 15 m apart; lower the minimum distance"),
        ({"mandatory": FIRST_TWO, "positions": np.zeros(4, np.int64)}, "compete for the same positions"),
        (
            {
                "mandatory": np.array([[1, 0, 0, 1], [0, 1, 0, 0]], bool),
                "prices": np.array([6e3, 6e3, 6e3, 9e3]),
                "budget": 12e3,
                "min_distance": 15.0,
            },
            "within the budget of 12000; raise it to at least 15000",
        ),
        ({"visible": np.zeros((0, 4))}, "no candidate to choose from"),
        ({"visible": np.zeros((4, 0))}, "no target"),
    ],
)
def test_mistakes_are_named_in_one_sentence(changes, named):
    with pytest.raises(SeipError, match=named):
        finish(solve(row_problem(**changes)))


@pytest.mark.parametrize("risk", [Risk(), Risk(tail=0.5, failure="worst")], ids=["nominal", "risk"])
@pytest.mark.parametrize("returns", [False, True], ids=["coverage", "returns"])
@cases(60)
@given(st.integers(0, 10**6), st.randoms(use_true_random=False))
def test_order_of_candidates_and_targets_changes_nothing(returns, risk, seed, random):
    problem = random_problem(seed, returns=returns)
    if problem.most_sensors < risk.least_sensors:
        return
    changed = np.random.default_rng((9, seed)).random((3, *problem.amounts.shape)) < 0.8
    views = [problem.amounts * one for one in changed] if risk.tail < 1 else None
    rows, columns = (np.array(random.sample(range(size), size)) for size in problem.amounts.shape)
    shuffled = replace(
        problem,
        amounts=problem.amounts[rows][:, columns],
        weights=problem.weights[columns],
        **{name: getattr(problem, name)[rows] for name in ("prices", "positions", "xyz", "labels")},
        mandatory=problem.mandatory_groups[:, rows],
    )
    shuffled_views = None if views is None else [view[rows][:, columns] for view in views]
    try:
        here = finish(solve(problem, cases=views, risk=risk))
    except SeipError as refusal:
        with pytest.raises(SeipError, match=re.escape(str(refusal))):
            finish(solve(shuffled, cases=shuffled_views, risk=risk))
        return
    there = finish(solve(shuffled, cases=shuffled_views, risk=risk))
    np.testing.assert_array_equal(problem.labels[here.chosen], shuffled.labels[there.chosen])
    assert (here.status, here.notes) == (there.status, there.notes)
    assert (here.objective, here.bound) == pytest.approx((there.objective, there.bound), rel=1e-12)


def results(placement):
    return placement.chosen.tolist(), placement.objective, placement.bound, placement.gap, placement.notes


@pytest.mark.parametrize("g", [None, LOG_RETURNS], ids=["coverage", "returns"])
def test_the_same_inputs_give_the_same_bits(g):
    problem = hard_problem(60, 300, **({} if g is None else {"g": g}))
    first, again = (finish(solve(problem, SolverLimits(effort=0.3))) for _ in range(2))
    assert first.status == "feasible"
    assert results(first) == results(again)


def test_more_effort_gives_no_less_and_any_effort_a_valid_bound():
    problem = hard_problem(40, 200, count=4)
    placements = [finish(solve(problem, SolverLimits(effort=effort))) for effort in (1e-6, 0.01, 0.1, 8.0)]
    values, bounds = ([getattr(one, name) for one in placements] for name in ("objective", "bound"))
    best = placements[-1]
    assert (placements[0].status, best.status) == ("feasible", "optimal")
    assert (best.gap, best.notes) == (0.0, ())
    assert values == sorted(values)
    assert bounds == sorted(bounds, reverse=True)
    for one in placements[:-1]:
        assert one.objective <= best.objective <= one.bound
        assert one.gap == pytest.approx((one.bound - one.objective) / one.objective)
        assert one.notes == (() if one.status == "optimal" else (UNPROVEN,))
        assert one.objective == problem.value(one.chosen)


@pytest.mark.parametrize("after", [1, 2, 10, 40])
@pytest.mark.parametrize("g", [None, LOG_RETURNS], ids=["coverage", "returns"])
def test_acceptance_ends_the_search_at_once_with_a_placement(g, after):
    problem = hard_problem(60, 300, **({} if g is None else {"g": g}))
    acceptance = Acceptance()
    steps, placement, number = solve(problem, SolverLimits(effort=1e6, acceptance=acceptance)), None, 0
    while placement is None:
        try:
            next(steps)
        except StopIteration as end:
            placement = end.value
        number += 1
        if number == after:
            acceptance.accept()
    assert number <= after + 12  # at the first step a placement is still to be chosen, of eight sensors
    assert (placement.status, placement.notes) == ("feasible", (UNPROVEN,))
    assert len(placement.chosen) == 8
    longer = finish(solve(problem, SHORT))
    assert placement.objective <= longer.objective <= placement.bound
    assert placement.objective == pytest.approx(problem.value(placement.chosen))


def test_reports_show_a_placement_and_its_gap_and_these_only_improve():
    problem = hard_problem(60, 300)
    steps = list(
        solve(problem, SolverLimits(effort=0.5), describe=lambda chosen, value: f"{value:.0f} of {len(chosen)}")
    )
    found = [float(step.best.split()[0]) for step in steps if step.best]
    gaps = [step.gap for step in steps if step.gap is not None]
    assert len(found) > len(steps) - 10
    assert found == sorted(found)
    assert len(gaps) > 3
    assert gaps == sorted(gaps, reverse=True)
    assert {step.what for step in steps} >= {"choosing greedily", "improving the placement", "computing an upper bound"}
    pace = Pace()
    for number, step in enumerate(steps):
        pace.note(step, float(number))
        assert pace.seconds_left is None  # a search may end at any step


def test_sensors_that_add_nothing_are_left_out_with_a_note():
    one = finish(solve(row_problem([[1, 1], [1, 0], [0, 1]], count=3)))
    assert one.chosen.tolist() == [0]
    assert one.notes[0].startswith("1 of 3 sensors suffices: no further sensor")
    two = finish(solve(row_problem(HALVES, count=3)))
    assert two.chosen.tolist() == [0, 1]
    assert two.notes[0].startswith("2 of 3 sensors suffice:")
    enough = finish(solve(row_problem(HALVES, count=2)))
    assert enough.notes == ()


def test_a_known_placement_of_other_limits_is_never_lost():
    problem = hard_problem(60, 300)
    known = finish(solve(problem, SolverLimits(effort=1.0)))
    again = finish(solve(problem, SolverLimits(effort=1e-6), known=known.chosen))
    assert again.objective >= known.objective
    for count in (6, 10):
        other = finish(solve(replace(problem, count=count), SolverLimits(effort=1e-6), known=known.chosen))
        assert len(other.chosen) == count


@cases(100)
@given(st.integers(0, 10**6))
def test_greedy_has_its_guarantee_under_cardinality(seed):
    problem = random_problem(seed, budget=None, mandatory=None, min_distance=0.0, positions=np.arange(9))
    greedy, best = solve_greedy(problem), finish(solve(problem))
    assert best.status == "optimal"
    assert (1 - 1 / np.e) * best.objective <= greedy.objective <= best.objective + 1e-9
    assert greedy.notes == ()


def test_bound_of_expected_returns_is_a_share_of_returns():
    problem = row_problem(np.diag([3.0, 8.0, 1.0, 0.5]), g=LOG_RETURNS, weights=np.full(4, 0.25), count=2)
    placement = finish(solve(problem))
    assert placement.chosen.tolist() == [0, 1]
    assert placement.objective == pytest.approx(0.25 * (np.log(4.0) + np.log(9.0)))
    assert (placement.status, placement.gap) == ("optimal", 0.0)
