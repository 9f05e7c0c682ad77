"""Placement by expected returns against brute force, and its bound against every set."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seip_addon.core.choosing.placement.problem import PlacementProblem, relative_gap
from seip_addon.core.choosing.placement.returns_bounds import (
    HALVINGS,
    OPERATIONS_PER_LOGARITHM,
    OPERATIONS_PER_SLOPE,
    Completion,
)
from seip_addon.core.choosing.placement.returns_instance import make_returns_instance
from seip_addon.core.choosing.placement.returns_solver import greedy, greedy_returns, solve_returns
from seip_addon.core.choosing.placement.search_limits import (
    OPERATIONS_PER_UNIT,
    OVERHEAD_OPERATIONS,
    Clock,
    SolverLimits,
)
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
def test_the_order_of_poses_does_not_matter(seed):
    problem, returns = problem_of(seed, mandatory=None)
    order = np.random.default_rng(seed).permutation(len(returns))
    other = PlacementProblem(
        visible=problem.visible[order],
        weights=problem.weights,
        prices=problem.prices[order],
        positions=problem.positions[order],
        xyz=problem.xyz[order],
        labels=problem.labels[order],
        count=problem.count,
        budget=problem.budget,
        min_distance=problem.min_distance,
    )
    one = finish(solve_returns(problem, returns))
    again = finish(solve_returns(other, returns[order]))
    assert sorted(one.chosen.tolist()) == sorted(order[again.chosen].tolist())


@settings(max_examples=200, deadline=None)
@given(
    st.lists(st.floats(0.0, 1e5), min_size=0, max_size=6),
    st.floats(0.0, 1e6),
)
def test_the_inequality_of_the_bound(returns, t):
    c = math.log1p(t) - t / (1 + t)
    a = [min(r / (1 + t), math.log(math.exp(c) + r) - c) for r in returns]
    assert math.log1p(math.fsum(returns)) <= c + math.fsum(a) + 1e-9


def test_greedy_is_no_better():
    problem, returns = problem_of(3, count=3, budget=None, mandatory=None)
    greedy = finish(greedy_returns(problem, returns))
    best = finish(solve_returns(problem, returns))
    assert greedy.objective <= best.objective + 1e-9
    assert relative_gap(greedy.objective, greedy.bound) == math.inf


def test_without_returns_there_is_nothing_to_choose():
    problem, returns = problem_of(5)
    with pytest.raises(SeipError, match="no candidate has returns from any road user"):
        finish(solve_returns(problem, np.zeros_like(returns)))


def instance_of(poses, users, **limits):
    """An instance in which each pose is at a position of its own and none is dominated."""
    returns = np.random.default_rng(1).lognormal(1.0, 1.0, (poses, users)).astype(np.float32)
    xyz = np.arange(3.0 * poses).reshape(poses, 3)
    problem = PlacementProblem(
        visible=returns > 0,
        weights=np.ones(users),
        prices=np.full(poses, 1000.0),
        positions=np.arange(poses),
        xyz=xyz,
        labels=np.full(poses, "lidar"),
        **limits,
    )
    return make_returns_instance(problem, returns)


def test_greedy_counts_the_gains_of_each_step_as_work():
    instance, clock = instance_of(12, 40, count=3), Clock(math.inf)
    assert len(greedy(instance, np.zeros(0, dtype=np.int64), clock)) == 3
    steps = 4  # the last one finds that no further sensor is allowed
    of_each = OPERATIONS_PER_LOGARITHM * 12 * 40 + OVERHEAD_OPERATIONS
    assert clock.work == pytest.approx(steps * of_each / OPERATIONS_PER_UNIT)


def test_the_work_of_a_bound_includes_the_choice_that_it_begins_from():
    instance, work = instance_of(12, 40, count=3), []
    for chosen in (1, 11):
        clock, share = Clock(math.inf), np.zeros(12)
        share[:chosen] = 1.0
        next(Completion(instance, np.zeros(40)).falling_bounds(share, clock))
        work.append(clock.work * OPERATIONS_PER_UNIT)
    assert work[1] - work[0] == pytest.approx(10 * 40 * HALVINGS * OPERATIONS_PER_SLOPE)
