"""Where solvers begin to fail, what they say then, and how flat the top is."""

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
    solver_rows,
    solver_study,
    worst_for_greedy,
)

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.choosing.placement.near_optimal import near_optimal_set
from seip_addon.core.choosing.placement.problem import TIE_TOLERANCE
from seip_addon.core.choosing.placement.solver import solve, solve_greedy
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


@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-12, 1e-10]))
@cases(30, 6)
def test_disturbances_below_a_tie_move_no_choice(seed: int, by: float) -> None:
    problem, random = random_problem(seed)
    disturbed = replace(problem, weights=1 + by * random.uniform(-1, 1, 12))
    assert (finish(solve(problem)).chosen == finish(solve(disturbed)).chosen).all()


@pytest.mark.parametrize("count", [2, 4, 7])
def test_greedy_meets_its_bound_and_the_exact_solver_does_not(count: int) -> None:
    problem = worst_for_greedy(count)
    whole = problem.weights.sum()
    least = 1 - (1 - 1 / count) ** count
    assert least <= solve_greedy(problem).covered / whole < least + 2e-3
    exact = finish(solve(problem))
    assert exact.status == "optimal"
    assert exact.covered == pytest.approx(whole)


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.05, 0.3]))
@cases(40, 6)
def test_near_optimal_set_lists_exactly_what_enumeration_finds(seed: int, share: float) -> None:
    problem, _ = random_problem(seed)
    best = finish(solve(problem))
    top = finish(near_optimal_set(problem, best.chosen, share))
    useful = np.flatnonzero(problem.visible.any(axis=1))
    goal = (1 - share) * best.covered - 1e-9
    expected = {
        choice
        for size in (1, 2, 3)
        for choice in combinations(useful.tolist(), size)
        if covered(problem, np.array(choice)) >= goal
    }
    assert top.complete
    assert {tuple(row[row >= 0].tolist()) for row in top.placements} == expected
    assert top.covered.max() == pytest.approx(best.covered)
    common = [len(set(choice) & set(best.chosen.tolist())) for choice in expected]
    assert top.in_common.tolist() == np.bincount(common, minlength=len(best.chosen) + 1).tolist()
    assert len(top) == len(expected)


def test_rows_and_charts_of_a_study(tmp_path: Path) -> None:
    tie, time = TieCheck(1e-6, Share(0, 5), 0.0), TimeCheck("plane", 1.0, 1.1, 0.05, proven=False)
    with patch("headless.studies.stability.solver_limits.PLANE_ORDERS", (2, 3, 5)):
        study = finish(solver_study(1, limit=0.2))
    (greedy,) = (check for check in study.greedy if check.count == 4)
    rows = solver_rows(SolverStudy((), (tie,), (greedy,), (time,)))
    assert "68.4%" in rows[1].begins
    assert "gap 5.0%" in rows[2].begins
    problem, _ = random_problem(1)
    top = finish(near_optimal_set(problem, finish(solve(problem)).chosen, 0.1))
    charts.save_solver_chart(tmp_path / "solvers.png", study, "solvers")
    charts.save_near_optimal_chart(tmp_path / "flat.png", [("small", top)], "flat")
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in tmp_path.iterdir())
