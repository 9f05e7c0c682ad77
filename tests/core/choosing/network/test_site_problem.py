"""Placement problem of a site: values, budgets, installed sensors and file."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.network.site_problem import SiteProblem, check_problem
from tests.few import few


def random_problem(seed, criterion, most=3):
    """Return a problem of nine poses at six positions at most."""
    rng = np.random.default_rng(seed)
    poses, targets, users = 9, 40, 30 if criterion == "returns" else 0
    returns = rng.gamma(0.5, 10.0, (poses, users)) * (rng.random((poses, users)) < 0.4)
    return SiteProblem(
        criterion=criterion,
        visible=rng.random((poses, targets)) < 0.3,
        returns=returns.astype(np.float32),
        user_weights=rng.random(users) + 0.1,
        prices=rng.choice([14_000.0, 20_000.0], size=poses),
        positions=rng.integers(0, 6, size=poses),
        xyz=rng.normal(0.0, 30.0, (poses, 3)),
        heights=np.full(poses, 5.4),
        latlon=np.tile((54.3, 7.4), (poses, 1)),
        labels=np.array(["os1_128"] * poses),
        names=np.array([f"sidewalk {number}" for number in range(poses)]),
        most_sensors=most,
    )


def best_by_enumeration(problem, budget):
    """Return the largest value over all placements within a budget."""
    best = 0.0
    for number in range(1, problem.most_sensors + 1):
        for chosen in itertools.combinations(range(len(problem.prices)), number):
            apart = len(set(problem.positions[list(chosen)].tolist())) == number
            if apart and math.fsum(problem.prices[list(chosen)]) <= budget * (1 + 1e-9):
                best = max(best, problem.value(chosen))
    return best


@pytest.mark.parametrize("criterion", ["road", "returns"])
@pytest.mark.parametrize("seed", few(range(6), 2))
def test_solved_budget_is_the_best_of_all_placements(criterion, seed):
    problem = random_problem(seed, criterion)
    for budget in (20_000.0, 34_000.0, 60_000.0):
        found = finish(problem.solve(budget, 10.0))
        assert found.value == pytest.approx(best_by_enumeration(problem, budget), rel=1e-6)
        assert found.bound == pytest.approx(found.value)
        assert found.price <= budget
        assert found.value == pytest.approx(problem.value(found.chosen))


def test_file_keeps_everything(tmp_path):
    problem = random_problem(1, "returns")
    problem.save(tmp_path / "problem.npz", {"key": "a key"})
    again, header = SiteProblem.load(tmp_path / "problem.npz")
    assert header["key"] == "a key"
    for name, value in vars(problem).items():
        np.testing.assert_array_equal(getattr(again, name), value)


def test_damaged_file_is_refused(tmp_path):
    path = tmp_path / "problem.npz"
    random_problem(1, "road").save(path, {"key": "a key"})
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(SeipError, match="damaged"):
        SiteProblem.load(path)


@pytest.mark.parametrize(
    ("changed", "fault"),
    [
        (lambda problem: {"visible": np.zeros_like(problem.visible)}, "no candidate sees anything"),
        (lambda problem: {"prices": np.where(np.arange(9) == 4, 0.0, problem.prices)}, "os1_128 costs nothing"),
    ],
)
def test_sites_without_a_frontier_are_refused(changed, fault):
    problem = random_problem(1, "road")
    with pytest.raises(SeipError, match=fault):
        check_problem(replace(problem, **changed(problem)))
