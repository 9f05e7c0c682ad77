"""The integer program by concave values of returns, against brute force and against the program of coverage."""

import itertools
import math

import numpy as np
import pytest

from seip_addon.core.choosing.placement import returns_solver
from seip_addon.core.choosing.placement.concave_value import LogReturns
from seip_addon.core.choosing.placement.problem import TIE_TOLERANCE
from seip_addon.core.choosing.placement.returns_instance import make_returns_instance
from seip_addon.core.choosing.placement.returns_program import ReturnsProgram
from seip_addon.core.choosing.placement.search_limits import Clock, SolverLimits
from seip_addon.core.progress import finish
from tests.core.choosing.placement.test_returns_placement import problem_of

NONE = np.zeros(0, dtype=np.int64)


def best_of(instance, program):
    """Return the largest value of an allowed choice, by trying all."""
    choices = (
        np.array(chosen, dtype=np.int64)
        for number in range(instance.count + 1)
        for chosen in itertools.combinations(range(len(instance)), number)
    )
    return max((program.value(chosen) for chosen in choices if instance.feasible(chosen)), default=-math.inf)


def small_instance(seed, **changes):
    problem, returns = problem_of(seed, count=2 + seed % 2, **changes)
    return make_returns_instance(problem, returns)


@pytest.mark.parametrize("error", [0.3, 1e-4])
@pytest.mark.parametrize("most", [1.0, 5e4])
def test_tangents_exceed_the_logarithm_by_the_stated_error_and_no_more(error, most):
    g, s = LogReturns(), np.concatenate([[0.0], np.geomspace(1e-6 * most, most, 20_000)])
    lines = g.lines(most, error).up_to(most)
    excess = lines(s) - g(s)
    assert excess.min() >= -1e-12
    assert excess.max() <= error * (1 + 1e-9)
    if len(lines.slope) > 2:
        assert excess.max() > 0.95 * error  # no more lines than it takes


@pytest.mark.parametrize("seed", range(4))
def test_the_program_finds_the_best_of_all(seed):
    instance = small_instance(seed, mandatory=None)
    program = ReturnsProgram(instance)
    best = best_of(instance, program)
    proof = finish(program.improve(NONE, "highs", Clock(math.inf)))
    assert instance.feasible(proof.chosen)
    assert proof.value == pytest.approx(instance.value(proof.chosen))
    assert best - 2 * TIE_TOLERANCE <= proof.value <= best + 1e-12
    assert best - 2 * TIE_TOLERANCE <= proof.bound <= best + (2 * TIE_TOLERANCE if proof.optimal else 1e-5 * (1 + best))


@pytest.mark.parametrize("seed", range(2))
def test_a_named_solver_proves_what_branch_and_bound_leaves(seed, monkeypatch):
    monkeypatch.setattr(returns_solver, "BRANCHING_SHARE", 0.0)
    problem, returns = problem_of(seed)
    found = finish(returns_solver.solve_returns(problem, returns, SolverLimits("highs")))
    usual = finish(returns_solver.solve_returns(problem, returns, SolverLimits("auto")))
    assert found.solver.startswith("branch and bound, HiGHS")
    assert usual.solver == "branch and bound"
    assert (found.status, found.gap) == ("optimal", 0.0)
    assert found.objective == pytest.approx(usual.objective, abs=2 * TIE_TOLERANCE)
