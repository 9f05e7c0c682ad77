"""Where solvers begin to fail, and what they say then."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from pathlib import Path
from unittest.mock import patch

from headless.studies.stability import charts
from headless.studies.stability.shares import Share
from headless.studies.stability.solver_limits import (
    SolverStudy,
    TieCheck,
    TimeCheck,
    best_covered,
    covered,
    plain_problem,
    plane,
    solver_rows,
    solver_study,
    worst_for_greedy,
)

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.choosing.placement.cheapest import cheapest_for_coverage
from seip_addon.core.choosing.placement.problem import TIE_TOLERANCE
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.placement.solver import scale_notes, solve, solve_greedy
from seip_addon.core.progress import finish
from tests.oracles.random_cases import cases


def random_problem(seed: int, candidates: int = 9, targets: int = 12, count: int = 3):
    random = np.random.default_rng(seed)
    visible = random.random((candidates, targets)) < 0.35
    visible[0, 0] = True
    return plain_problem(visible, np.ones(targets), count), random


@given(st.integers(0, 2**32 - 1), st.sampled_from([0, 6, 12, 18]))
@cases(40, 6)
def test_what_is_lost_to_weights_far_apart_is_said(seed: int, decades: int) -> None:
    problem, random = random_problem(seed)
    problem = replace(problem, weights=10 ** (decades * (random.random(12) - 0.5)))
    found, best = finish(solve(problem)), best_covered(problem)
    assert found.covered >= best * (1 - 2 * TIE_TOLERANCE)
    if found.covered < best * (1 - 1e-12):
        assert any("too little to affect the choice" in note for note in found.notes)


@given(st.integers(0, 2**32 - 1), st.sampled_from([3, 6, 9]))
@cases(30, 6)
def test_prices_far_apart_lose_nothing(seed: int, decades: int) -> None:
    problem, random = random_problem(seed)
    prices = 10 ** (decades * (random.random(9) - 0.5))
    problem = replace(problem, prices=prices, budget=float(np.sort(prices)[4]))
    allowed = [c for k in (1, 2, 3) for c in combinations(range(9), k) if prices[list(c)].sum() <= problem.budget]
    best = max(covered(problem, np.array(choice)) for choice in allowed)
    assert finish(solve(problem)).covered == best


def test_light_targets_and_cheap_sensors_are_named() -> None:
    problem, _ = random_problem(3)
    assert scale_notes(problem) == ()
    weights, prices = np.ones(12), np.ones(9)
    weights[:2], prices[0] = 1e-12, 1e-12
    light = replace(problem, weights=weights, prices=prices)
    notes = scale_notes(light)
    assert notes[0].startswith("2 of 12 targets")
    assert notes[1].startswith("1 candidates")
    assert notes[0] in finish(solve(light)).notes
    assert notes[0] in finish(cheapest_for_coverage(light, 0.3)).notes


@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-12, 1e-10]))
@cases(30, 6)
def test_disturbances_below_a_tie_move_no_choice(seed: int, by: float) -> None:
    problem, random = random_problem(seed)
    disturbed = replace(problem, weights=1 + by * random.uniform(-1, 1, 12))
    assert (finish(solve(problem)).chosen == finish(solve(disturbed)).chosen).all()


@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-8, 1e-5, 1e-2]))
@cases(30, 6)
def test_a_choice_changes_only_where_the_objective_says_so(seed: int, by: float) -> None:
    problem, random = random_problem(seed)
    disturbed = replace(problem, weights=1 + by * random.uniform(-1, 1, 12))
    plain, other = finish(solve(problem)), finish(solve(disturbed))
    assert covered(problem, other.chosen) >= plain.covered * (1 - 2 * by) - 1e-9
    assert other.covered == pytest.approx(best_covered(disturbed), rel=1e-9)


@pytest.mark.parametrize("count", [2, 4, 7])
def test_greedy_meets_its_bound_and_the_exact_solver_does_not(count: int) -> None:
    problem = worst_for_greedy(count)
    whole = problem.weights.sum()
    least = 1 - (1 - 1 / count) ** count
    assert least <= solve_greedy(problem).covered / whole < least + 2e-3
    exact = finish(solve(problem))
    assert exact.status == "optimal"
    assert exact.covered == pytest.approx(whole)


@pytest.mark.parametrize("order", [2, 3, 5])
def test_planes_are_planes(order: int) -> None:
    problem = plane(order)
    assert len(problem.visible) == order**2 + order + 1
    assert (problem.visible.sum(axis=1) == order + 1).all()
    meetings = problem.visible.astype(int) @ problem.visible.T
    assert (meetings[~np.eye(len(meetings), dtype=bool)] == 1).all()


def test_a_second_is_a_second() -> None:
    found = finish(solve(plane(17), SolverLimits(time_limit=1.0)))
    assert found.seconds < 5.0  # shared machines stall
    assert found.bound >= found.covered
    assert found.status == "optimal" or any("search ended before" in note for note in found.notes)


def test_rows_and_charts_of_a_study(tmp_path: Path) -> None:
    tie, time = TieCheck(1e-6, Share(0, 5), 0.0), TimeCheck("plane", 1.0, 1.1, 0.05, proven=False)
    with patch("headless.studies.stability.solver_limits.PLANE_ORDERS", (2, 3, 5)):
        study = finish(solver_study(1, limit=0.2))
    (greedy,) = (check for check in study.greedy if check.count == 4)
    rows = solver_rows(SolverStudy((), (tie,), (greedy,), (time,)))
    assert "68.4%" in rows[1].begins
    assert "gap 5.0%" in rows[2].begins
    charts.save_solver_chart(tmp_path / "solvers.png", study, "solvers")
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in tmp_path.iterdir())
