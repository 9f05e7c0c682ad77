"""The integer program by concave values of returns, against brute force and against the program of coverage."""

import itertools
import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seip_addon.core.choosing.placement import returns_solver
from seip_addon.core.choosing.placement.concave_value import Lines, LogReturns
from seip_addon.core.choosing.placement.integer_program import CoverProgram
from seip_addon.core.choosing.placement.problem import TIE_TOLERANCE
from seip_addon.core.choosing.placement.reduced_problem import make_instance
from seip_addon.core.choosing.placement.returns_instance import make_returns_instance
from seip_addon.core.choosing.placement.returns_program import ReturnsProgram
from seip_addon.core.choosing.placement.search_limits import Clock, SolverLimits
from seip_addon.core.progress import finish
from tests.core.choosing.placement.test_returns_placement import problem_of
from tests.few import few

NONE = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class Saturating:
    """The value g(s) = min(s/k, 1): k returns are enough. For k = 1 and returns of 0 and 1 it is coverage.

    Parameters
    ----------
    enough : float
        k, above 0.
    """

    enough: float = 1.0

    def __call__(self, s):
        """Return min(s/k, 1)."""
        return np.minimum(s / self.enough, 1.0)

    def lines(self, most, error):  # noqa: ARG002  # it is piecewise linear itself
        """Return its two pieces, whose minimum is g."""
        return Lines(np.array([0.0, 1.0]), np.array([1 / self.enough, 0.0])).up_to(most)

    def tangent(self, s):
        """Return the piece at s."""
        return (0.0, 1 / self.enough) if s < self.enough else (1.0, 0.0)


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


@pytest.mark.parametrize("error", [0.3, 0.01, 1e-4])
@pytest.mark.parametrize("most", [1e-3, 1.0, 5e4])
def test_tangents_exceed_the_logarithm_by_the_stated_error_and_no_more(error, most):
    g, s = LogReturns(), np.concatenate([[0.0], np.geomspace(1e-6 * most, most, 20_000)])
    lines = g.lines(most, error).up_to(most)
    excess = lines(s) - g(s)
    assert excess.min() >= -1e-12
    assert excess.max() <= error * (1 + 1e-9)
    if len(lines.slope) > 2:
        assert excess.max() > 0.95 * error  # no more lines than it takes


@pytest.mark.parametrize("g", [LogReturns(), Saturating(3.0)])
def test_a_tangent_touches_its_function(g):
    s = np.linspace(0, 20, 200)
    for at in (0.0, 0.5, 3.0, 11.0):
        intercept, slope = g.tangent(at)
        assert intercept + slope * at == pytest.approx(float(g(np.array(at))), abs=1e-12)
        assert (intercept + slope * s >= g(s) - 1e-12).all()


def check_best_of_all(seed):
    instance = small_instance(seed, mandatory=None)
    program = ReturnsProgram(instance)
    best = best_of(instance, program)
    proof = finish(program.improve(NONE, "highs", Clock(math.inf)))
    assert instance.feasible(proof.chosen)
    assert proof.value == pytest.approx(instance.value(proof.chosen))
    assert best - 2 * TIE_TOLERANCE <= proof.value <= best + 1e-12
    assert best - 2 * TIE_TOLERANCE <= proof.bound <= best + (2 * TIE_TOLERANCE if proof.optimal else 1e-5 * (1 + best))


@pytest.mark.parametrize("seed", few(range(40), 12))
def test_the_program_finds_the_best_of_all(seed):
    check_best_of_all(seed)


@pytest.mark.slow
@given(st.integers(0, 10**9))
def test_the_program_finds_the_best_of_all_of_many(seed):
    check_best_of_all(seed)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**9), st.sampled_from([0.3, 0.03]))
def test_its_first_bound_is_above_the_best_value_by_no_more_than_the_stated_error(seed, error):
    instance = small_instance(seed)
    program = ReturnsProgram(instance, error=error)
    best = best_of(instance, program)
    bound = finish(program.maximise(program.objective, "highs", Clock(math.inf))).bound / program.scale
    assert best - 1e-5 <= bound <= best + error + 1e-5


@pytest.mark.parametrize("seed", few(range(10), 3))
def test_with_cbc_it_finds_the_same(seed):
    instance = small_instance(seed)
    proofs = [finish(ReturnsProgram(instance).improve(NONE, one, Clock(math.inf))) for one in ("highs", "cbc")]
    assert proofs[0].value == pytest.approx(proofs[1].value, abs=2 * TIE_TOLERANCE)


@pytest.mark.parametrize("seed", few(range(30), 10))
def test_one_return_that_is_enough_is_coverage(seed):
    problem, returns = problem_of(seed, mandatory=None)
    covering, scale = make_instance(problem)
    covered = finish(CoverProgram(covering).maximise_coverage("highs", Clock(math.inf))).bound / scale
    instance = make_returns_instance(problem, (returns > 0).astype(np.float32))
    proof = finish(ReturnsProgram(instance, Saturating()).improve(NONE, "highs", Clock(math.inf)))
    assert proof.bound <= proof.value + 1e-5
    assert proof.value * problem.weights.sum() == pytest.approx(covered)


def test_at_the_limit_the_bound_still_holds():
    instance = small_instance(3)
    program = ReturnsProgram(instance)
    clock = Clock(math.inf, 1e-6)
    clock.spend(1e9)
    proof = finish(program.improve(NONE, "highs", clock))
    assert (proof.optimal, proof.value, proof.bound) == (False, 0.0, math.inf)


@pytest.mark.parametrize("seed", few(range(30), 8))
def test_a_named_solver_proves_what_branch_and_bound_leaves(seed, monkeypatch):
    monkeypatch.setattr(returns_solver, "BRANCHING_SHARE", 0.0)
    problem, returns = problem_of(seed)
    found = finish(returns_solver.solve_returns(problem, returns, SolverLimits("highs")))
    usual = finish(returns_solver.solve_returns(problem, returns, SolverLimits("auto")))
    assert found.solver.startswith("branch and bound, HiGHS")
    assert usual.solver == "branch and bound"
    assert (found.status, found.gap) == ("optimal", 0.0)
    assert found.objective == pytest.approx(usual.objective, abs=2 * TIE_TOLERANCE)
