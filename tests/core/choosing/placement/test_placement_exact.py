"""The exact solver against exhaustive search."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from seip_addon.core.choosing.placement.problem import PlacementProblem
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.placement.solver import solve, solve_greedy
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
from tests.oracles.placement_oracle import all_placements, covered, small_problems
from tests.oracles.random_cases import cases

thorough = cases(150)
quick = cases(40)


@quick
@given(st.data())
def test_highs_and_cbc_agree(data: st.DataObject) -> None:
    problem = accepted(data, small_problems())
    assume(all_placements(problem))
    by_highs, by_cbc = (
        finish(solve(problem, SolverLimits("highs"))),
        finish(solve(problem, SolverLimits("cbc"))),
    )
    np.testing.assert_array_equal(by_highs.chosen, by_cbc.chosen)


@quick
@given(st.data(), st.randoms(use_true_random=False))
def test_order_of_candidates_and_targets_changes_nothing(data: st.DataObject, random: object) -> None:
    problem = accepted(data, small_problems())
    assume(all_placements(problem))
    rows = random.sample(range(len(problem.visible)), len(problem.visible))  # type: ignore[attr-defined]
    columns = random.sample(range(problem.visible.shape[1]), problem.visible.shape[1])  # type: ignore[attr-defined]
    shuffled = reordered(problem, np.array(rows), np.array(columns))
    for method in (lambda p: finish(solve(p)), solve_greedy):
        here, there = method(problem), method(shuffled)
        np.testing.assert_array_equal(problem.labels[here.chosen], shuffled.labels[there.chosen])
        assert (here.objective, here.bound) == (there.objective, there.bound)


@thorough
@given(small_problems(limits=False))
def test_greedy_reaches_its_guarantee_under_cardinality(problem: PlacementProblem) -> None:
    best = max(covered(problem, choice) for choice in all_placements(problem))
    found = solve_greedy(problem)
    assert (1 - 1 / np.e) * best <= found.objective <= best + 1e-9
    assert found.bound >= best - 1e-9


def accepted(data: st.DataObject, problems: st.SearchStrategy[PlacementProblem]) -> PlacementProblem:
    """Draw a problem that is not refused when it is made."""
    try:
        return data.draw(problems)
    except SeipError:
        assume(condition=False)
        raise


def reordered(problem: PlacementProblem, rows: np.ndarray, columns: np.ndarray) -> PlacementProblem:
    return replace(
        problem,
        visible=problem.visible[rows][:, columns],
        weights=problem.weights[columns],
        prices=problem.prices[rows],
        positions=problem.positions[rows],
        xyz=problem.xyz[rows],
        labels=problem.labels[rows],
        mandatory=problem.mandatory[:, rows],
        forbidden=problem.forbidden[rows],
    )
