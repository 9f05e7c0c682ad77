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

from seip_addon.core.choosing.placement import cheapest, integer_program, solver
from seip_addon.core.choosing.placement.cheapest import cheapest_for_coverage
from seip_addon.core.choosing.placement.integer_program import Outcome, cover_by_cliques
from seip_addon.core.choosing.placement.problem import PlacementProblem
from seip_addon.core.choosing.placement.reduced_problem import common_unit, make_instance, merge_targets
from seip_addon.core.choosing.placement.search_limits import Clock, SolverLimits
from seip_addon.core.choosing.placement.solver import solve, solve_greedy
from seip_addon.core.choosing.placement.solvers import is_available
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import Progress, finish

if TYPE_CHECKING:
    from collections.abc import Generator
    from pathlib import Path

    from seip_addon.core.arrays import Integer
    from seip_addon.core.choosing.placement.reduced_problem import Instance


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


def test_two_suffice_where_four_are_asked_for() -> None:
    placement = finish(solve(row_problem(halves, count=4)))
    assert placement.chosen.tolist() == [0, 1]
    assert placement.status == "optimal"
    assert any("2 of 4 sensors suffice" in note for note in placement.notes)


def test_of_equal_placements_the_cheapest_then_the_most_doubly_seen() -> None:
    visible = [[1, 1, 1, 0], [0, 0, 0, 1], [0, 0, 1, 1], [0, 1, 1, 1]]
    cheap_second = row_problem(visible, count=2, prices=np.array([5.0, 1.0, 2.0, 2.0]))
    assert finish(solve(cheap_second)).chosen.tolist() == [0, 1]
    assert finish(solve(row_problem(visible, count=2))).chosen.tolist() == [0, 3]


def test_a_bound_that_only_a_better_placement_meets_proves_nothing() -> None:
    visible = [[1, 1, 1, 1, 1, 0, 0], [1, 1, 1, 0, 0, 0, 1], [1, 1, 1, 1, 0, 1, 0], [1] * 7]
    problem = row_problem(visible, positions=np.array([0, 1, 2, 2]), mandatory=np.array([[0, 1, 1, 0]], bool), count=2)
    assert finish(solve(problem)).chosen.tolist() == [1, 3]


def test_a_mandatory_group_is_served_and_paid_for() -> None:
    placement = finish(solve(row_problem(halves, count=3, mandatory=np.array([[0, 0, 1, 0]], bool))))
    assert placement.chosen.tolist() == [0, 1, 2]
    assert placement.covered == 4
    assert placement.price == 18000


def test_a_budget_buys_the_best_mix() -> None:
    problem = row_problem(halves, prices=np.array([3.0, 3.0, 1.0, 1.0]), budget=4.0)
    placement = finish(solve(problem))
    assert placement.covered == 3
    assert placement.chosen.tolist() == [2, 3]
    assert finish(solve(replace(problem, budget=6.0))).covered == 4


def test_sensors_keep_their_distance() -> None:
    placement = finish(solve(row_problem(halves, min_distance=10.5)))
    assert np.diff(placement.chosen).min() > 1
    assert finish(solve(row_problem(halves, min_distance=10.0))).covered == 4


def test_duplicates_and_blind_candidates_change_nothing() -> None:
    plain = finish(solve(row_problem(halves, count=2)))
    more = finish(solve(row_problem([*halves, *halves, [0, 0, 0, 0]], count=2)))
    assert (more.objective, more.chosen.tolist()) == (plain.objective, plain.chosen.tolist())


def test_targets_that_nothing_sees_count_against_coverage_only() -> None:
    problem = row_problem([[1, 0, 0], [0, 1, 0]])
    assert finish(solve(problem)).objective == 2
    with pytest.raises(SeipError, match=r"100\.00% cannot be reached: no placement covers more than 66\.67%"):
        finish(cheapest_for_coverage(problem, 1.0))


def test_reverse_with_equal_prices_takes_the_fewest() -> None:
    placement = finish(cheapest_for_coverage(row_problem(halves), 1.0))
    assert (placement.chosen.tolist(), placement.objective, placement.bound) == ([0, 1], 12000, 12000)


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_scaling_all_weights_changes_nothing(scale: float) -> None:
    problem = street_problem(20, 300, blocks=1, count=3)
    plain = finish(solve(problem))
    scaled = finish(solve(replace(problem, weights=problem.weights * scale)))
    np.testing.assert_array_equal(scaled.chosen, plain.chosen)
    assert scaled.objective == pytest.approx(plain.objective * scale, rel=1e-12)


def test_weights_of_very_different_size() -> None:
    weights = np.array([1e9, 1e-9, 1.0, 1.0])
    placement = finish(solve(row_problem([[1, 0, 0, 0], [0, 1, 1, 1]], weights=weights, count=1)))
    assert placement.chosen.tolist() == [0]


@pytest.mark.parametrize("limit", [1e-6, 0.01, 0.3])
def test_a_short_time_limit_gives_an_incumbent_and_a_valid_bound(limit: float) -> None:
    problem = street_problem(66, 1000, blocks=3, count=5)
    short, greedy = finish(solve(problem, SolverLimits(time_limit=limit))), solve_greedy(problem)
    best = finish(solve(problem, SolverLimits(time_limit=3.0)))
    assert greedy.objective <= short.objective <= best.bound
    assert short.bound >= best.objective
    assert short.gap == pytest.approx((short.bound - short.objective) / short.objective)
    if short.status == "feasible":
        assert any("search ended before" in note for note in short.notes)


def test_a_short_time_limit_on_the_reverse_problem() -> None:
    placement = finish(cheapest_for_coverage(street_problem(60, 1000, blocks=2), 0.8, SolverLimits(time_limit=0.01)))
    assert placement.covered >= 800
    best = finish(cheapest_for_coverage(street_problem(60, 1000, blocks=2), 0.8, SolverLimits(time_limit=10.0)))
    assert 6000 <= placement.bound <= best.price <= placement.objective == placement.price


def test_solvers_agree_on_a_street() -> None:
    problem = street_problem(25, 400, blocks=2, count=3, min_distance=30.0)
    by_highs, by_cbc = finish(solve(problem)), finish(solve(problem, SolverLimits("cbc")))
    assert by_highs.status == by_cbc.status == "optimal"
    np.testing.assert_array_equal(by_highs.chosen, by_cbc.chosen)
    assert by_highs.solver.startswith("HiGHS")
    assert by_cbc.solver.startswith("CBC")


def test_cbc_without_its_run_bit_is_copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = tmp_path / "cbc"
    shutil.copyfile(pulp.apis.coin_api.pulp_cbc_path, broken)
    broken.chmod(stat.S_IRUSR)
    monkeypatch.setattr(integer_program, "pulp_cbc_path", str(broken))
    assert finish(solve(row_problem(halves, count=2), SolverLimits("cbc"))).covered == 4
    assert not os.access(broken, os.X_OK)


def test_merging_targets_keeps_weight_and_does_not_depend_on_order() -> None:
    rng = np.random.default_rng(3)
    visible, weight = rng.random((4, 300)) < 0.5, rng.integers(0, 9, 300).astype(float)
    order = rng.permutation(300)
    merged, sums = merge_targets(visible, weight)
    again, same = merge_targets(visible[:, order], weight[order])
    assert len(np.unique(merged, axis=1).T) == len(sums) == 15
    assert sums.sum() == weight[visible.any(axis=0)].sum()
    np.testing.assert_array_equal(merged, again)
    np.testing.assert_array_equal(sums, same)


@pytest.mark.slow
def test_of_many_pairs_that_see_all_the_one_that_sees_most_twice() -> None:
    problem = street_problem(60, 1000, blocks=2, count=6)
    visible = problem.visible.copy()
    visible[7] = np.arange(1000) > 0
    visible[9] = np.arange(1000) % 2 == 0
    visible[100] = np.arange(1000) % 2 == 1
    visible[11, 0] = True
    problem = replace(problem, visible=visible)
    numbers = visible.astype(np.float64)
    pairs = ((1 - numbers) @ (1 - numbers).T == 0) & (problem.positions[:, None] != problem.positions)
    placement = finish(solve(problem))
    assert pairs.sum() > 40
    assert pairs[tuple(placement.chosen)]
    assert visible[placement.chosen].all(axis=0).sum() == (numbers @ numbers.T)[pairs].max()
    assert len(placement.notes) == 1


def test_dominated_candidates_at_one_position_are_dropped() -> None:
    problem = row_problem([[1, 1, 0], [1, 0, 0], [0, 0, 1]], positions=np.array([0, 0, 1]))
    instance, _ = make_instance(problem)
    assert instance.original.tolist() == [0, 2]
    elsewhere, _ = make_instance(replace(problem, positions=np.arange(3)))
    assert elsewhere.original.tolist() == [0, 1, 2]


def test_cliques_cover_every_conflict_and_nothing_else() -> None:
    rng = np.random.default_rng(5)
    conflict = np.triu(rng.random((20, 20)) < 0.3, 1)
    conflict |= conflict.T
    covered = np.zeros_like(conflict)
    for clique in cover_by_cliques(conflict):
        covered[np.ix_(clique, clique)] = True
    np.fill_diagonal(covered, val=False)
    np.testing.assert_array_equal(covered, conflict)


def test_a_mandatory_pose_that_sees_nothing() -> None:
    problem = row_problem([[0, 0], [1, 1]], mandatory=np.array([[1, 0]], bool), count=1)
    assert solve_greedy(problem).chosen.tolist() == [0]
    placement = finish(solve(problem))
    assert placement.chosen.tolist() == [0]
    assert (placement.objective, placement.bound, placement.gap, placement.status) == (0, 0, 0, "optimal")


@pytest.mark.parametrize("seed", range(6))
def test_greedy_bound_holds_on_many_targets_of_two_weights(seed: int) -> None:
    rng = np.random.default_rng(seed)
    visible = rng.random((20, 20_000)) < 0.5
    visible[1] = ~visible[0]
    problem = row_problem(visible, weights=rng.choice([1.0, 4.0], 20_000), count=2)
    assert solve_greedy(problem).bound >= problem.weights.sum()


@pytest.mark.parametrize("weights", [[1.0] * 4, [0.1, 0.2, 0.3, 0.3], [1.0, 1.5, 2.0, 2.5], [0.7, 1.9, np.pi, 2.0]])
def test_greedy_takes_the_first_of_equal_gains(weights: list[float]) -> None:
    problem = row_problem([[1, 1, 0, 0]] * 3 + [[0, 0, 1, 1]] * 3, weights=np.array(weights), count=2)
    assert solve_greedy(problem).chosen.tolist() == [0, 3]


@pytest.mark.parametrize(
    ("weights", "unit"),
    [([2.0, 2.0], 2.0), ([1.0, 1.5], 0.5), ([0.1, 0.3], 0.1), ([2.0, 3.0, 7.0], 1.0), ([3.0, 3.0 + 1e-12], 3.0)],
)
def test_weights_have_a_common_unit(weights: list[float], unit: float) -> None:
    assert common_unit(np.array(weights)) == (pytest.approx(unit), True)


@pytest.mark.parametrize("weights", [[1.0, np.pi], [3.0, 3.0 + 1e-7], [1.0, 1e17]])
def test_weights_without_a_common_unit_get_a_fine_grain(weights: list[float]) -> None:
    unit, whole = common_unit(np.array(weights))
    assert not whole
    assert np.rint(np.array(weights) / unit).sum() < 2**53


def test_a_program_out_of_time_is_not_called_infeasible(monkeypatch: pytest.MonkeyPatch) -> None:
    def unfinished(*_: object) -> Generator[Progress, None, Outcome]:
        yield Progress(0, 0, "")
        return Outcome(None, np.inf, finished=False)

    monkeypatch.setattr(integer_program.CoverProgram, "maximise", unfinished)
    with pytest.raises(SeipError, match="did not find out within 20 s whether the mandatory places"):
        finish(solve(row_problem(halves, mandatory=first_two)))


def test_the_note_on_an_unproven_price_fits_the_gap(monkeypatch: pytest.MonkeyPatch) -> None:
    """The gap is a share of the price that was found: half of it may be saved where it is 50%."""
    monkeypatch.setattr(cheapest, "_cheapest", unproven)
    placement = finish(cheapest.cheapest_for_coverage(row_problem(halves, prices=np.array([2.0, 4.0, 3.0, 5.0])), 0.9))
    assert placement.bound == placement.objective / 2
    assert placement.gap == 0.5
    assert any("the gap is the share of its price that another one may save" in note for note in placement.notes)


def unproven(instance: Instance, chosen: Integer, *_: object) -> Generator[Progress, None, tuple[Integer, float]]:
    """Stand for a search that runs out of time with a bound of half the price."""
    yield from ()
    return chosen, math.fsum(instance.price[chosen]) / 2


@pytest.mark.parametrize("limit", [0.0, -1.0, float("nan")])
def test_a_time_limit_is_positive(limit: float) -> None:
    with pytest.raises(SeipError, match="give a positive number of seconds"):
        finish(solve(row_problem(halves), SolverLimits(time_limit=limit)))
    with pytest.raises(SeipError, match="give a positive number of seconds"):
        finish(cheapest_for_coverage(row_problem(halves), 0.5, SolverLimits(time_limit=limit)))


@pytest.mark.parametrize("solver", ["highs", "cbc"])
def test_there_may_be_no_time_limit(solver: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("seip_addon.core.choosing.placement.solver.is_worthwhile", lambda *_: False)
    monkeypatch.setattr(cheapest, "is_worthwhile", lambda *_: False)
    problem = street_problem(12, 100, blocks=1, count=3)
    placement = finish(solve(problem, SolverLimits(solver=solver, time_limit=math.inf)))
    assert placement.status == "optimal"
    dearer = replace(problem, count=None, prices=np.linspace(1, 2, len(problem.prices)))
    assert (
        finish(cheapest_for_coverage(dearer, 0.3, SolverLimits(solver=solver, time_limit=math.inf))).status == "optimal"
    )


@pytest.mark.slow
def test_a_long_program_can_be_stopped_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("seip_addon.core.choosing.placement.solver.is_worthwhile", lambda *_: False)
    before = set(threading.enumerate())
    steps = solve(street_problem(40, 500, blocks=2, count=8), SolverLimits(time_limit=60.0))
    while "integer program" not in next(steps).what:
        pass
    next(steps)
    steps.close()
    for thread in set(threading.enumerate()) - before:
        thread.join(5.0)
        assert not thread.is_alive()


nowhere = np.array([[0, 0, 0, 0]], bool)
first_two = np.array([[1, 0, 0, 0], [0, 1, 0, 0]], bool)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"count": 0}, "the number of sensors is 0; it must be at least 1"),
        ({"count": 5}, "5 sensors are requested, but there are only 4 positions"),
        ({"count": 4, "forbidden": np.array([True, False, False, False])}, "there are only 3 positions"),
        ({"budget": 5000.0}, "budget of 5000 is below the cheapest sensor, which costs 6000"),
        ({"budget": float("nan")}, "below the cheapest sensor"),
        ({"weights": np.array([1.0, -1.0, 1.0, 1.0])}, "every weight must be"),
        ({"weights": np.array([1.0, np.nan, 1.0, 1.0])}, "every weight must be"),
        ({"weights": np.zeros(4)}, "the weight of every target is 0"),
        ({"prices": np.array([1.0, np.inf, 1.0, 1.0])}, "every price must be"),
        ({"forbidden": np.ones(4, bool)}, "every candidate is forbidden"),
        ({"xyz": np.full((4, 3), np.nan)}, "coordinates are not finite"),
        ({"min_distance": -1.0}, "minimum distance is -1.0 m"),
        ({"mandatory": nowhere}, "mandatory group 1 must carry a sensor"),
        (
            {"mandatory": first_two, "mandatory_names": np.array(["A", "B"]), "forbidden": first_two[1]},
            "B must carry a sensor, but every candidate there is forbidden",
        ),
        ({"visible": np.zeros((4, 4), bool)}, "no candidate sees any target"),
        ({"mandatory": first_two, "count": 1}, "cannot all carry a sensor with 1 sensors; allow at least 2"),
        ({"mandatory": first_two, "budget": 6000.0}, "within the budget of 6000; raise it to at least 12000"),
        ({"mandatory": first_two, "min_distance": 15.0}, "at least 15 m apart; lower the minimum distance"),
        ({"mandatory": first_two, "positions": np.zeros(4, np.int64)}, "compete for the same positions"),
        (
            {"mandatory": first_two, "min_distance": 15.0, "count": 1, "budget": 6000.0},
            "within the number, budget and minimum distance together",
        ),
    ],
)
def test_mistakes_are_named_in_one_sentence(changes: dict[str, object], sentence: str) -> None:
    with pytest.raises(SeipError, match=sentence.replace("(", r"\(")):
        finish(solve(row_problem(**({"visible": halves} | changes))))  # type: ignore[arg-type]


def test_no_candidates_and_no_targets() -> None:
    with pytest.raises(SeipError, match="no candidate to choose from"):
        replace(row_problem(halves), visible=np.zeros((0, 4), bool))
    with pytest.raises(SeipError, match="no target to see"):
        row_problem([[], []])


@pytest.mark.parametrize("coverage", [0.0, -0.5, 1.01, float("nan")])
def test_a_coverage_is_a_share(coverage: float) -> None:
    with pytest.raises(SeipError, match="give a share above 0"):
        finish(cheapest_for_coverage(row_problem(halves), coverage))


def test_coverage_out_of_reach_of_the_limits() -> None:
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


@pytest.mark.parametrize("offset", [0.0, 1000.0, 5e6])
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
@pytest.mark.parametrize("solver", ["highs", "cbc"])
def test_the_same_effort_gives_the_same_answer_again(solver: str) -> None:
    first, again = (finish(solve(hard_problem(), SolverLimits(solver, math.inf, 0.3))) for _ in range(2))
    assert first.status == "feasible"
    assert [(one.chosen.tolist(), one.objective, one.bound, one.notes) for one in (first, again)] == 2 * [
        (first.chosen.tolist(), first.objective, first.bound, first.notes)
    ]


@pytest.mark.slow
@pytest.mark.parametrize("goal", [0, 320])
def test_a_search_that_ends_at_its_limit_of_branches_is_an_answer(goal: int) -> None:
    visible = np.random.default_rng(7).random((150, 400)) < 0.12
    problem = replace(street_problem(150, 400, heights=1), visible=visible, weights=np.ones(400), count=8)
    program = integer_program.reaching(make_instance(problem)[0], goal)
    outcome = finish(program.maximise_coverage("highs", SolverLimits("highs", math.inf, 1e-3).clock()))
    assert not outcome.finished
    if goal:  # eight of them see fewer
        assert outcome.chosen is None
    else:
        assert outcome.chosen is not None
        assert visible[outcome.chosen].any(axis=0).sum() <= outcome.bound < 400


@pytest.mark.slow
def test_more_effort_proves_no_less() -> None:
    little, more = (finish(solve(hard_problem(), SolverLimits("highs", math.inf, effort))) for effort in (0.1, 1.0))
    assert little.objective <= more.objective <= more.bound < little.bound


@pytest.mark.slow
def test_an_answer_that_is_not_proven_says_what_more_time_does() -> None:
    short, longer = (finish(solve(hard_problem(), SolverLimits("highs", math.inf, effort))) for effort in (1.2, 2.0))
    assert "hardly closed in the second half of the search" in short.notes[1]
    assert "halfway through the search and is" in longer.notes[1]


@pytest.mark.parametrize("effort", [0.0, -1.0, math.nan])
def test_an_effort_is_positive(effort: float) -> None:
    with pytest.raises(SeipError, match=r"the effort is .* units of work; give a positive number"):
        finish(solve(row_problem(halves), SolverLimits(effort=effort)))


@pytest.mark.slow
def test_breaking_ties_takes_no_longer_than_the_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    # all is seen by many choices: the proof is quick, the ties are many
    visible = np.random.default_rng(1).random((300, 200)) < 0.5
    problem = replace(street_problem(300, 200, heights=1), visible=visible, count=12)
    clock, proven = Clock(math.inf), []
    broken = solver.canonical_optimum

    def noted(*arguments: object) -> object:
        proven.append(clock.work)
        return broken(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(solver, "canonical_optimum", noted)
    monkeypatch.setattr(solver, "MIN_TIE_BREAKING_WORK", 0.5)
    placement = finish(solver.solve_within(problem, "highs", clock))
    assert placement.status == "optimal"
    assert any("not all ties were broken" in note for note in placement.notes)
    assert clock.work < proven[0] + 1.1 * max(proven[0], solver.MIN_TIE_BREAKING_WORK)
