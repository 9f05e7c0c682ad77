"""Frontier, allocation and their search against enumeration of all placements at all sites."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seip_addon.core.base.progress import Progress, finish
from seip_addon.core.choosing.network import network_search
from seip_addon.core.choosing.network.allocation import allocate, allocation_of, relaxed_allocation
from seip_addon.core.choosing.network.frontier import Frontier, Options, SolvedBudget, possible_amounts
from seip_addon.core.choosing.network.network_search import search_allocation

MOST = 3


class EnumeratedSite:
    """A site whose best placements are found by enumeration."""

    def __init__(self, rng):
        self.prices = rng.choice(rng.integers(5, 40, size=3) * 500.0, size=rng.integers(3, 7))
        self.positions = rng.integers(0, len(self.prices), size=len(self.prices))
        shape = (len(self.prices), 12)
        self.returns = rng.gamma(0.5, 20.0, shape) * (rng.random(shape) < 0.5)

    def value(self, chosen):
        return float(np.log1p(self.returns[list(chosen)].sum(axis=0)).mean())

    def placements(self):
        """Yield price, value and poses of every placement."""
        for number in range(MOST + 1):
            for chosen in itertools.combinations(range(len(self.prices)), number):
                if len(set(self.positions[list(chosen)])) == number:
                    yield math.fsum(self.prices[list(chosen)]), self.value(chosen) if chosen else 0.0, chosen

    def frontier(self, budget):
        amounts, ends = possible_amounts(self.prices, self.positions, MOST, budget)
        everything = self.value(range(len(self.prices)))
        return Frontier(amounts, ends, everything)


def solver(sites, looseness=0.0):
    """Return a solver by enumeration; with looseness its placements and bounds are poor until the effort grows."""

    def solve(requests):
        yield Progress(0, 0, "enumeration")
        results = []
        for one in requests:
            within = [row for row in sites[one.site].placements() if row[0] <= one.budget * (1 + 1e-9)]
            best = max(within, key=lambda row: row[1])
            loose = looseness if one.effort < 16 else 0.0
            found = max((row for row in within if row[1] <= best[1] * (1 - loose)), key=lambda row: row[1])
            results.append(SolvedBudget(one.budget, found[2], found[0], found[1], best[1] * (1 + loose), one.effort))
        return results

    return solve


def best_of_all(sites, weights, budget):
    """Return the largest weighted value within a budget, over all combinations of placements."""
    reached = {0.0: 0.0}
    for site, weight in zip(sites, weights, strict=True):
        best = {}
        for price, value, _ in site.placements():
            best[price] = max(best.get(price, -math.inf), value)
        after = {}
        for spent, so_far in reached.items():
            for price, value in best.items():
                total = round(spent + price, 6)
                if total <= budget * (1 + 1e-9):
                    after[total] = max(after.get(total, -math.inf), so_far + weight * value)
        reached = after
    return max(reached.values())


@pytest.fixture(params=["integer", "relaxed"])
def rounds(request, monkeypatch):
    """Rounds of searches by the integer program alone, and by the relaxation first."""
    monkeypatch.setattr(network_search, "MANY_SITES", 0 if request.param == "relaxed" else math.inf)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.usefixtures("rounds")
def test_search_finds_the_best_allocation_of_each_budget(seed):
    rng = np.random.default_rng(seed)
    sites = [EnumeratedSite(rng) for _ in range(3)]
    weights, budgets = rng.choice([0.5, 1.0, 3.0], size=3), (rng.integers(1, 90, size=4) * 1000.0).tolist()
    for budget in budgets:
        known = [site.frontier(budget) for site in sites]
        found = finish(search_allocation(known, weights, budget, 0.0, solver(sites, 0.05)))
        best = best_of_all(sites, weights, budget)
        assert found.value == pytest.approx(best, rel=1e-9)
        assert found.bound >= best * (1 - 1e-9)
        assert found.bound == pytest.approx(best, rel=1e-6)
        assert found.price <= budget * (1 + 1e-9)
        assert found.price == pytest.approx(math.fsum(one.price for one in found.taken))


@pytest.mark.parametrize("seed", range(4))
def test_the_relaxation_of_very_many_sites_loses_less_than_one_site(monkeypatch, seed):
    monkeypatch.setattr(network_search, "MANY_SITES", 0)
    monkeypatch.setattr(network_search, "EXACT_SITES", 0)
    rng = np.random.default_rng(2000 + seed)
    sites = [EnumeratedSite(rng) for _ in range(4)]
    weights, budget = rng.choice([0.5, 1.0, 3.0], size=4), float(rng.integers(20, 90) * 1000)
    known = [site.frontier(budget) for site in sites]
    found = finish(search_allocation(known, weights, budget, 0.0, solver(sites, 0.05)))
    best = best_of_all(sites, weights, budget)
    dearest = max(weight * one.ceiling for weight, one in zip(weights, known, strict=True))
    assert best - dearest <= found.value <= best * (1 + 1e-9)
    assert found.bound >= best * (1 - 1e-9)
    assert found.price <= budget * (1 + 1e-9)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.usefixtures("rounds")
def test_a_search_that_ends_early_has_a_bound_that_holds(seed):
    rng = np.random.default_rng(1000 + seed)
    sites = [EnumeratedSite(rng) for _ in range(4)]
    weights, budget = np.ones(4), float(rng.integers(20, 90) * 1000)
    known = [site.frontier(budget) for site in sites]
    found = finish(search_allocation(known, weights, budget, 0.2, solver(sites, 0.1)))
    best = best_of_all(sites, weights, budget)
    assert found.value <= best * (1 + 1e-9)
    assert found.bound >= best * (1 - 1e-9)
    assert found.bound <= found.value * 1.2 * (1 + 1e-9)


@given(
    st.lists(st.lists(st.tuples(st.integers(0, 40), st.integers(0, 1000)), max_size=4), min_size=1, max_size=4),
    st.integers(0, 120),
)
@settings(max_examples=10, deadline=None)
def test_allocation_equals_enumeration_and_no_relaxed_one_is_worse(tables, budget):
    tables = [[(0, 0), *table] for table in tables]
    options = [
        Options(*(np.array(column, dtype=np.float64) for column in zip(*table, strict=True)), np.arange(len(table)))
        for table in tables
    ]
    within = [
        sum(value for _, value in rows)
        for rows in itertools.product(*tables)
        if sum(price for price, _ in rows) <= budget
    ]
    found = allocate(options, np.ones(len(options)), float(budget))
    assert found.value == pytest.approx(max(within))
    assert found.price <= budget * (1 + 1e-9)
    relaxed = relaxed_allocation(options, np.ones(len(options)), float(budget))
    assert relaxed.value >= max(within) * (1 - 1e-9)
    lower = allocation_of(options, np.ones(len(options)), [parts[0] for parts in relaxed.taken])
    assert lower.price <= budget * (1 + 1e-6)
    assert lower.value <= max(within) * (1 + 1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_bounds_of_a_frontier_hold_for_every_placement(seed):
    rng = np.random.default_rng(seed)
    site = EnumeratedSite(rng)
    known = site.frontier(100_000.0)
    budgets = rng.choice(known.amounts[1:], size=min(2, len(known.amounts) - 1), replace=False)
    for budget in budgets.tolist():
        best = max((row for row in site.placements() if row[0] <= budget + 1e-6), key=lambda row: row[1])
        known = known.with_solved(SolvedBudget(budget, best[2], best[0], best[1], best[1], 1.0))
    bounds = known.bounds()
    assert (np.diff(bounds) >= 0).all()
    for price, value, _ in site.placements():
        if price <= 100_000.0:
            assert value <= bounds[np.searchsorted(known.amounts, price + 1e-6) - 1] + 1e-12
