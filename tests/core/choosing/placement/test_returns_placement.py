"""Placement by expected returns against brute force, and its bound against every set."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.choosing.placement.problem import PlacementProblem
from seip_addon.core.choosing.placement.returns_bounds import Completion
from seip_addon.core.choosing.placement.returns_instance import make_returns_instance
from seip_addon.core.choosing.placement.returns_solver import solve_returns
from seip_addon.core.choosing.placement.search_limits import Clock, SolverLimits
from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish


def problem_of(seed, **changes):
    """A random problem: few positions with several poses, returns of very different sizes, many zeros."""
    random = np.random.default_rng(seed)
    positions, heights, users = random.integers(3, 8), random.integers(1, 4), random.integers(1, 30)
    poses = positions * heights
    returns = random.lognormal(random.uniform(-2, 4), random.uniform(0.2, 3), (poses, users))
    returns *= random.random((poses, users)) < random.uniform(0.1, 1.0)
    if random.random() < 0.3:
        returns = np.round(returns)
    returns[random.integers(poses), random.integers(users)] = 7.0
    weights = random.choice([0.0, 1.0, 2.0, 0.3], users, p=[0.1, 0.5, 0.2, 0.2])
    weights[returns.any(axis=0).argmax()] = 1.0
    xyz = np.zeros((poses, 3))
    position = np.repeat(np.arange(positions), heights)
    xyz[:, :2] = random.uniform(0, 30, (positions, 2))[position]
    xyz[:, 2] = np.tile(np.arange(heights), positions)
    prices = random.choice([1000.0, 2500.0, 4000.0], poses)
    limits = {"count": int(random.integers(1, 5))}
    limits["count"] = min(limits["count"], int(positions))
    if random.random() < 0.5:
        limits["budget"] = float(random.uniform(prices.min(), 9000.0))
        if random.random() < 0.5:
            del limits["count"]
    if random.random() < 0.4:
        limits["min_distance"] = float(random.uniform(1, 12))
    if random.random() < 0.3:
        group = np.zeros((1, poses), dtype=bool)
        group[0, prices.argmin()] = True
        limits["mandatory"] = group
    problem = PlacementProblem(
        visible=returns > 0,
        weights=weights,
        prices=prices,
        positions=position,
        xyz=xyz,
        labels=np.full(poses, "lidar"),
        **(limits | changes),
    )
    return problem, returns.astype(np.float32)


def value_of(problem, returns, chosen):
    together = returns[list(chosen)].astype(float).sum(axis=0)
    return math.fsum(w * math.log(1 + s) for w, s in zip(problem.weights, together, strict=True)) / math.fsum(
        problem.weights
    )


def allowed(problem, chosen):
    chosen = list(chosen)
    if problem.count is not None and len(chosen) > problem.count:
        return False
    if problem.budget is not None and problem.prices[chosen].sum() > problem.budget * (1 + 1e-9):
        return False
    for one, other in itertools.combinations(chosen, 2):
        if problem.positions[one] == problem.positions[other]:
            return False
        if math.dist(problem.xyz[one, :2], problem.xyz[other, :2]) < problem.min_distance - 1e-6:
            return False
    return all(group[chosen].any() for group in problem.mandatory_groups)


def best_by_brute_force(problem, returns):
    best = -1.0
    most = problem.count or len(np.unique(problem.positions))
    by_position = [np.flatnonzero(problem.positions == p).tolist() for p in np.unique(problem.positions)]
    for number in range(min(most, len(by_position)) + 1):
        for places in itertools.combinations(by_position, number):
            for chosen in itertools.product(*places):
                if allowed(problem, chosen):
                    best = max(best, value_of(problem, returns, chosen))
    return best


@given(st.integers(0, 10**9))
def test_the_placement_is_the_best_of_all(seed):
    problem, returns = problem_of(seed)
    found = finish(solve_returns(problem, returns))
    assert found.status == "optimal"
    assert found.gap == 0
    assert allowed(problem, found.chosen)
    assert found.objective == pytest.approx(value_of(problem, returns, found.chosen), rel=1e-9, abs=1e-12)
    best = best_by_brute_force(problem, returns)
    assert found.objective >= best - 2e-9


@given(st.integers(0, 10**9))
def test_at_the_limit_the_bound_still_holds(seed):
    problem, returns = problem_of(seed, count=3, budget=None, mandatory=None)
    found = finish(solve_returns(problem, returns, SolverLimits(effort=1e-9)))
    best = best_by_brute_force(problem, returns)
    assert found.objective <= best + 2e-9
    assert found.bound >= best - 2e-9


@given(st.integers(0, 10**9))
def test_no_set_adds_more_than_any_of_the_falling_bounds(seed):
    problem, returns = problem_of(seed, budget=None, count=2, mandatory=None)
    instance = make_returns_instance(problem, returns)
    completion = Completion(instance, np.zeros(len(instance.weight)))
    share = np.full(len(instance), 1 / len(instance))
    bounds = itertools.islice(completion.falling_bounds(share, Clock(math.inf)), 12)
    best = best_by_brute_force(problem, returns)
    assert min(bound.value for bound, _ in bounds) >= best * (1 - 1e-9)


def test_without_returns_there_is_nothing_to_choose():
    problem, returns = problem_of(5)
    with pytest.raises(SeipError, match="no candidate has returns from any road user"):
        finish(solve_returns(problem, np.zeros_like(returns)))
