"""Placement: users' mistakes, limits of time and of numbers, and what the answer says."""

from __future__ import annotations

import math
import os
import shutil
import stat
import threading
from dataclasses import replace
from typing import TYPE_CHECKING

from headless.studies.benchmark.street_visibility import street_problem

import numpy as np
import pulp.apis.coin_api
import pytest

from seip_addon.core.choosing.placement import integer_program
from seip_addon.core.choosing.placement.cheapest import cheapest_for_coverage
from seip_addon.core.choosing.placement.integer_program import Outcome
from seip_addon.core.choosing.placement.problem import PlacementProblem
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from seip_addon.core.choosing.placement.solver import solve, solve_greedy
from seip_addon.core.choosing.placement.solvers import is_available
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import Progress, finish

if TYPE_CHECKING:
    from collections.abc import Generator
    from pathlib import Path


def row_problem(visible: list[list[int]], **changes: object) -> PlacementProblem:
    """Poses 10 m apart on a line, one at each position, all of one type."""
    number, targets = np.shape(visible)
    problem = PlacementProblem(
        visible=np.array(visible, bool),
        weights=np.ones(targets),
        prices=np.full(number, 6000.0),
        positions=np.arange(number),
        xyz=np.column_stack([10.0 * np.arange(number), np.zeros(number), np.full(number, 5.0)]),
        labels=np.full(number, "type1"),
    )
    return replace(problem, **changes)  # type: ignore[arg-type]


halves = [[1, 1, 0, 0], [0, 0, 1, 1], [0, 1, 1, 0], [0, 0, 0, 1]]


@pytest.mark.parametrize("limit", [1e-6, 0.01])
def test_a_short_time_limit_gives_an_incumbent_and_a_valid_bound(limit: float) -> None:
    problem = street_problem(66, 1000, blocks=3, count=5)
    short, greedy = finish(solve(problem, SolverLimits(time_limit=limit))), solve_greedy(problem)
    best = finish(solve(problem, SolverLimits(effort=0.3)))
    assert greedy.objective <= short.objective <= best.bound
    assert short.bound >= best.objective
    assert short.gap == pytest.approx((short.bound - short.objective) / short.objective)
    if short.status == "feasible":
        assert any("search ended before" in note for note in short.notes)


def test_cbc_without_its_run_bit_is_copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = tmp_path / "cbc"
    shutil.copyfile(pulp.apis.coin_api.pulp_cbc_path, broken)
    broken.chmod(stat.S_IRUSR)
    monkeypatch.setattr(integer_program, "pulp_cbc_path", str(broken))
    assert finish(solve(row_problem(halves, count=2), SolverLimits("cbc"))).covered == 4
    assert not os.access(broken, os.X_OK)


def test_a_program_out_of_time_is_not_called_infeasible(monkeypatch: pytest.MonkeyPatch) -> None:
    def unfinished(*_: object) -> Generator[Progress, None, Outcome]:
        yield Progress(0, 0, "")
        return Outcome(None, np.inf, finished=False)

    monkeypatch.setattr(integer_program.CoverProgram, "maximise", unfinished)
    with pytest.raises(SeipError, match="did not find out within 20 s whether the mandatory places"):
        finish(solve(row_problem(halves, mandatory=first_two)))


@pytest.mark.slow
def test_a_long_program_can_be_stopped_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("seip_addon.core.choosing.placement.solver.is_worthwhile", lambda *_: False)
    before = set(threading.enumerate())
    steps = solve(hard_problem(), SolverLimits("highs", time_limit=60.0))
    while "integer program" not in next(steps).what:
        pass
    next(steps)
    steps.close()
    for thread in set(threading.enumerate()) - before:
        thread.join(5.0)
        assert not thread.is_alive()


first_two = np.array([[1, 0, 0, 0], [0, 1, 0, 0]], bool)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"count": 5}, "only 4 positions"),
        ({"budget": 5000.0}, "costs 6000"),
        ({"weights": np.array([1.0, np.nan, 1.0, 1.0])}, "weight"),
        ({"prices": np.array([1.0, np.inf, 1.0, 1.0])}, "price"),
        ({"mandatory": first_two, "mandatory_names": np.array(["A", "B"]), "forbidden": first_two[1]}, "B must carry"),
        ({"visible": np.zeros((4, 4), bool)}, "no candidate sees"),
        ({"mandatory": first_two, "count": 1}, "at least 2"),
        ({"mandatory": first_two, "budget": 6000.0}, "at least 12000"),
        ({"mandatory": first_two, "min_distance": 15.0}, "lower the minimum distance"),
        ({"mandatory": first_two, "positions": np.zeros(4, np.int64)}, "the same positions"),
        ({"visible": np.zeros((0, 4), bool)}, "no candidate"),
    ],
)
def test_mistakes_are_named_in_one_sentence(changes: dict[str, object], named: str) -> None:
    with pytest.raises(SeipError, match=named):
        finish(solve(row_problem(**({"visible": halves} | changes))))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("limits", "named"), [({"time_limit": math.nan}, "number of seconds"), ({"effort": 0.0}, "effort")]
)
def test_limits_of_a_search_are_positive(limits: dict[str, float], named: str) -> None:
    for search in (solve, lambda problem, limits: cheapest_for_coverage(problem, 0.5, limits)):
        with pytest.raises(SeipError, match=named):
            finish(search(row_problem(halves), SolverLimits(**limits)))  # type: ignore[arg-type]


def test_coverage_that_cannot_be_had_is_refused() -> None:
    with pytest.raises(SeipError, match="give a share above 0"):
        finish(cheapest_for_coverage(row_problem(halves), 1.01))
    with pytest.raises(SeipError, match=r"75\.00% cannot be reached: no placement covers more than 50\.00%"):
        finish(cheapest_for_coverage(row_problem(halves, count=1), 0.75))


def test_unknown_and_missing_solvers_name_the_others() -> None:
    with pytest.raises(SeipError, match="unknown solver 'cplex'; choose among highs, cbc"):
        finish(solve(row_problem(halves), SolverLimits(solver="cplex")))
    if not is_available("gurobi"):
        with pytest.raises(SeipError, match="gurobi is not available here; choose among highs, cbc"):
            finish(solve(row_problem(halves), SolverLimits(solver="gurobi")))


def test_greedy_states_its_guarantee() -> None:
    assert "1 - 1/e" in solve_greedy(row_problem(halves, count=2)).notes[0]
    assert "one half" in solve_greedy(row_problem(halves, count=2, positions=np.array([0, 0, 1, 1]))).notes[0]
    assert "(1 - 1/e)/2" in solve_greedy(row_problem(halves, budget=12000.0)).notes[0]
    assert "no guarantee" in solve_greedy(row_problem(halves, count=2, min_distance=5.0)).notes[0]


@pytest.mark.parametrize("offset", [0.0, 5e6])
def test_posts_exactly_as_far_apart_as_asked_for_may_both_carry_a_sensor(offset):
    xyz = np.array([(offset + x, offset, 4.0) for x in (0.0, 0.3, 0.6)])
    problem = PlacementProblem(
        visible=np.eye(3, dtype=bool),
        weights=np.ones(3),
        prices=np.ones(3),
        positions=np.arange(3),
        xyz=xyz,
        labels=np.full(3, "type1"),
        count=3,
        min_distance=0.3,
    )
    assert len(finish(solve(problem)).chosen) == 3


def hard_problem() -> PlacementProblem:
    """Return a problem whose proof takes minutes: sensors that overlap a little everywhere."""
    visible = np.random.default_rng(7).random((150, 900)) < 0.12
    return replace(street_problem(150, 900, heights=1), visible=visible, count=8)


@pytest.mark.slow
def test_the_same_effort_gives_the_same_answer_again() -> None:
    first, again = (finish(solve(hard_problem(), SolverLimits("highs", math.inf, 0.3))) for _ in range(2))
    assert first.status == "feasible"
    assert [(one.chosen.tolist(), one.objective, one.bound, one.notes) for one in (first, again)] == 2 * [
        (first.chosen.tolist(), first.objective, first.bound, first.notes)
    ]


@pytest.mark.slow
def test_more_effort_proves_no_less() -> None:
    little, more = (finish(solve(hard_problem(), SolverLimits("highs", math.inf, effort))) for effort in (0.1, 1.0))
    assert little.objective <= more.objective <= more.bound < little.bound
