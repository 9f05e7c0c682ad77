"""Common practices against the allocation, on random sites."""

import math

from headless.studies.network_practice.practices import PRACTICES, four_corners, greedy

import numpy as np
import pytest

from seip_addon.core.choosing.network.network_search import Goal, search_allocations
from seip_addon.core.progress import Progress, finish
from tests.builders.random_site import random_problem


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("criterion", ["road", "returns"])
def test_no_practice_beats_the_allocation_or_spends_more(seed, criterion):
    sites = [random_problem(10 * seed + number, criterion) for number in range(4)]
    weights, money = np.array([1.0, 2.0, 1.0, 0.5]), 100_000.0

    def solve(requests):
        yield Progress(0, 0, "sites")
        return [finish(sites[one.site].solve(one.budget, 10.0)) for one in requests]

    known = [site.frontier(money) for site in sites]
    (best,) = finish(search_allocations(known, weights, [Goal(money, 0.0)], solve))
    for practice in PRACTICES.values():
        chosen = practice(sites, weights, money)
        price = math.fsum(site.prices[list(poses)].sum() for site, poses in zip(sites, chosen, strict=True))
        value = weights @ [site.value(poses) for site, poses in zip(sites, chosen, strict=True)]
        assert price <= money
        assert value <= best.value + 1e-9


def test_four_corners_are_one_in_each_quadrant_of_the_most_important_site():
    sites = [random_problem(number, "road", most=4) for number in range(2)]
    first, second = four_corners(sites, np.array([1.0, 2.0]), 85_000.0)
    assert not first
    plan = sites[1].xyz[list(second), :2] - np.median(sites[1].xyz[:, :2], axis=0)
    assert len({(bool(x >= 0), bool(y >= 0)) for x, y in plan.tolist()}) == len(second) >= 3


def test_greedy_takes_the_best_single_sensor_first():
    site = random_problem(3, "returns")
    best = max(range(9), key=lambda pose: site.value([pose]))
    assert greedy(site, 1e9)[0] == best
