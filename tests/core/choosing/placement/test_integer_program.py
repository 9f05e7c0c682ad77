"""Integer programs by the solvers that are installed: the same placements as branch and bound finds."""

import math
import os
import shutil
import stat
import threading

import numpy as np
import pulp.apis.coin_api
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement import integer_program
from seip_addon.core.choosing.placement.incumbent import Incumbent
from seip_addon.core.choosing.placement.instance import make_instance
from seip_addon.core.choosing.placement.integer_program import (
    CoverageProgram,
    PlacementProgram,
    check_solver,
    prove_by_program,
    solver_name,
)
from seip_addon.core.choosing.placement.search_limits import SolverLimits, Work
from seip_addon.core.choosing.placement.solver import solve
from tests.builders.placement_problems import HALVES, all_choices, hard_problem, random_problem, row_problem


def worst_of(instance, work=math.inf):
    """Return the worst placement of an instance as the incumbent."""
    incumbent = Incumbent(instance, Work(work))
    incumbent.offer(min(all_choices(instance), key=instance.value))
    return incumbent


@pytest.mark.parametrize("solver", ["highs", "cbc"])
def test_program_finds_and_proves_the_best_of_all_choices(solver):
    compared = 0
    for seed in range(12):
        instance = make_instance(random_problem(seed))
        choices = all_choices(instance)
        if not choices:
            continue
        incumbent, every = worst_of(instance), np.arange(len(instance))
        finish(prove_by_program(incumbent, every, solver, Work(math.inf)))
        assert incumbent.value == pytest.approx(max(map(instance.value, choices)), abs=CoverageProgram(instance).margin)
        assert incumbent.proven or instance.step < 1
        compared += incumbent.proven
    assert compared > 3


@pytest.mark.parametrize("solver", ["highs", "cbc"])
def test_bound_of_an_unfinished_program_holds(solver):
    for seed in range(6):
        instance = make_instance(random_problem(seed))
        choices = all_choices(instance)
        if not choices:
            continue
        incumbent, part = worst_of(instance), Work(1e-9)
        finish(prove_by_program(incumbent, np.arange(len(instance)), solver, part))
        assert part.left <= 0
        assert incumbent.bound >= max(map(instance.value, choices)) - instance.slack


@pytest.mark.parametrize("solver", ["highs", "cbc"])
def test_choices_that_just_exceed_the_budget_are_not_feasible(solver):
    """Two sensors of 0.1 and 0.2 cost 0.30000000000000004 in floats: within 0.3, but not within a billionth less."""
    for budget, number in ((0.3, 2), (0.3 * (1 - 3e-9), 1)):
        instance = make_instance(row_problem(np.eye(2), prices=np.array([0.1, 0.2]), budget=budget))
        program = PlacementProgram(instance)
        chosen = finish(program.maximise(program.number, solver, Work(math.inf))).chosen
        assert len(chosen) == number
        assert instance.feasible(chosen)


def test_a_named_solver_proves_what_branch_and_bound_leaves(monkeypatch):
    monkeypatch.setattr("seip_addon.core.choosing.placement.branch_and_bound.ROOT_STEPS", 0)
    usual, named = (finish(solve(hard_problem(20, 60, count=6), SolverLimits(one))) for one in ("auto", "highs"))
    assert usual.solver == "branch and bound"
    assert named.solver.startswith("branch and bound, HiGHS")
    for one in (usual, named):
        assert (one.status, one.gap) == ("optimal", 0.0)
    assert named.objective == usual.objective


def test_unknown_and_missing_solvers_name_the_others(monkeypatch):
    assert solver_name("auto") == "highs"
    assert check_solver("auto").startswith("HiGHS ")
    assert check_solver("cbc").startswith("CBC of PuLP ")
    with pytest.raises(SeipError, match="unknown solver 'cplex'; choose among highs, cbc"):
        finish(solve(row_problem(count=2), SolverLimits("cplex")))
    monkeypatch.setattr(integer_program, "is_available", lambda name: name == "cbc")
    assert solver_name("auto") == "cbc"
    with pytest.raises(SeipError, match="gurobi is not available here; choose among cbc"):
        finish(solve(row_problem(count=2), SolverLimits("gurobi")))


def test_cbc_without_its_run_bit_is_copied(tmp_path, monkeypatch):
    broken = tmp_path / "cbc"
    shutil.copyfile(pulp.apis.coin_api.pulp_cbc_path, broken)
    broken.chmod(stat.S_IRUSR)
    monkeypatch.setattr(integer_program, "pulp_cbc_path", str(broken))
    instance = make_instance(row_problem(HALVES, count=2))
    incumbent = worst_of(instance)
    finish(prove_by_program(incumbent, np.arange(len(instance)), "cbc", Work(math.inf)))
    assert incumbent.value == 4
    assert not os.access(broken, os.X_OK)


def test_a_long_program_can_be_stopped_at_once():
    before = set(threading.enumerate())
    instance = make_instance(hard_problem(60, 300))
    incumbent = Incumbent(instance, Work(math.inf))
    incumbent.offer(np.arange(8))
    steps = prove_by_program(incumbent, np.arange(len(instance)), "highs", Work(math.inf))
    assert "integer program of 60 candidates" in next(steps).what
    next(steps)
    steps.close()
    for thread in set(threading.enumerate()) - before:
        thread.join(5.0)
        assert not thread.is_alive()
