"""Integer programs by the solvers that are installed: the same placements as branch and bound finds."""

import math
import os
import shutil
import stat
import threading

import numpy as np
import pulp.apis.coin_api
import pytest

from seip_addon.core.choosing.placement import integer_program
from seip_addon.core.choosing.placement.branch_and_bound import BranchAndBound
from seip_addon.core.choosing.placement.incumbent import Incumbent
from seip_addon.core.choosing.placement.instance import make_instance
from seip_addon.core.choosing.placement.integer_program import (
    ConcaveProgram,
    check_solver,
    prove_by_program,
    solver_name,
)
from seip_addon.core.choosing.placement.search_limits import SolverLimits, Work
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
from tests.builders.placement_problems import HALVES, all_choices, hard_problem, random_problem, row_problem


def worst_of(instance, work=math.inf):
    """Return the worst placement of an instance as the incumbent."""
    incumbent = Incumbent(instance, Work(work))
    incumbent.offer(min(all_choices(instance), key=instance.value))
    return incumbent


@pytest.mark.parametrize("returns", [False, True], ids=["coverage", "returns"])
@pytest.mark.parametrize("solver", ["highs", "cbc"])
def test_program_finds_and_proves_what_branch_and_bound_does(solver, returns):
    compared = 0
    for seed in range(12):
        instance = make_instance(random_problem(seed, returns=returns))
        if not all_choices(instance):
            continue
        by_program, by_branching = worst_of(instance), worst_of(instance)
        every = np.arange(len(instance))
        assert finish(prove_by_program(by_program, every, solver, Work(math.inf)))
        search = BranchAndBound(by_branching, instance.relaxed(np.ones(1)))
        finish(search.start())
        assert finish(search.run())
        assert by_program.proven
        assert by_program.value == pytest.approx(by_branching.value, abs=2 * instance.slack)
        assert by_program.bound == pytest.approx(by_branching.bound, abs=2 * instance.slack)
        compared += 1
    assert compared > 8


@pytest.mark.parametrize("returns", [False, True], ids=["coverage", "returns"])
@pytest.mark.parametrize("solver", ["highs", "cbc"])
def test_bound_of_an_unfinished_program_holds(solver, returns):
    for seed in range(6):
        instance = make_instance(random_problem(seed, returns=returns))
        choices = all_choices(instance)
        if not choices:
            continue
        incumbent, part = worst_of(instance), Work(1e-9)
        finish(prove_by_program(incumbent, np.arange(len(instance)), solver, part))
        assert part.left <= 0 or incumbent.proven
        assert incumbent.bound >= max(map(instance.value, choices)) - instance.slack


@pytest.mark.parametrize("returns", [False, True], ids=["coverage", "returns"])
def test_value_in_the_program_is_that_of_the_instance(returns):
    instance = make_instance(random_problem(2, returns=returns))
    for choice in all_choices(instance)[1:6]:
        program = ConcaveProgram(instance)
        if returns:
            program.add_tangents(choice)
        for number, x in enumerate(program.x):
            program.model += x == int(number in choice)
        outcome = finish(program.maximise(program.objective, "highs", Work(math.inf)))
        assert outcome.bound / program.scale == pytest.approx(instance.value(choice), abs=program.margin)


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
