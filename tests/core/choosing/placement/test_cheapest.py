"""The cheapest placement for a share of the weight: its price, its certificate, and reasons why there is none."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from seip_addon.core.base.acceptance import Acceptance
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.cheapest import UNPROVEN_NUMBER, UNPROVEN_PRICE, cheapest_for_share
from seip_addon.core.choosing.placement.search_limits import SolverLimits
from tests.builders.placement_problems import HALVES, hard_problem, row_problem

PRICES = np.array([6.0, 6.0, 5.0, 2.0])


@pytest.mark.parametrize(
    ("share", "chosen", "price"),
    [(0.25, [3], 2.0), (0.5, [2], 5.0), (0.75, [2, 3], 7.0), (1.0, [0, 1], 12.0)],
)
def test_price_is_the_least_that_reaches_the_share(share, chosen, price):
    problem = row_problem(HALVES, prices=PRICES)
    placement = finish(cheapest_for_share(problem, share))
    assert placement.chosen.tolist() == chosen
    assert (placement.objective, placement.bound, placement.gap, placement.status) == (price, price, 0.0, "optimal")
    assert problem.value(placement.chosen) == 4 * share


def test_of_equally_cheap_placements_the_one_that_covers_most_is_chosen():
    placement = finish(cheapest_for_share(row_problem([[1, 1, 0, 0], [1, 1, 1, 0]]), 0.5))
    assert placement.chosen.tolist() == [1]


@pytest.mark.parametrize("price", [0.0, 7.0])
def test_where_all_prices_are_equal_the_fewest_sensors_are_the_cheapest(price):
    seen = np.concatenate([np.eye(5, dtype=bool), ~np.eye(5, dtype=bool)])  # any two of the last five see all
    placement = finish(cheapest_for_share(row_problem(seen, prices=np.full(10, price)), 1.0))
    assert (len(placement.chosen), placement.status, placement.objective) == (2, "optimal", 2 * price)


def test_share_that_is_out_of_reach_or_of_range_is_refused():
    for share in (0.0, 1.01):
        with pytest.raises(SeipError, match="give a share above 0"):
            finish(cheapest_for_share(row_problem(HALVES), share))
    with pytest.raises(SeipError, match=r"75\.00% cannot be reached: no placement covers more than 50\.00%"):
        finish(cheapest_for_share(row_problem(HALVES, count=1), 0.75))
    with pytest.raises(SeipError, match="unknown solver"):
        finish(cheapest_for_share(row_problem(HALVES), 0.5, SolverLimits("cplex")))
    with pytest.raises(SeipError, match="allow at least 2"):
        finish(cheapest_for_share(row_problem(HALVES, count=1, mandatory=np.eye(4, dtype=bool)[:2]), 0.25))


def test_groups_are_served_even_if_the_share_needs_fewer_sensors():
    problem = row_problem(HALVES, prices=PRICES, mandatory=np.eye(4, dtype=bool)[:2])
    placement = finish(cheapest_for_share(problem, 0.25))
    assert (placement.chosen.tolist(), placement.price, placement.status) == ([0, 1], 12.0, "optimal")


@pytest.mark.parametrize("effort", [1e-6, 0.1])
def test_unproven_price_has_a_bound_and_a_note(effort):
    random = np.random.default_rng(5)
    problem = hard_problem(60, 300, count=None, prices=random.choice([6.0, 15.0, 20.0], 60))
    short, longer = (finish(cheapest_for_share(problem, 0.6, SolverLimits(effort=one))) for one in (effort, 1.0))
    assert short.status == "feasible"
    assert short.notes[0] == UNPROVEN_PRICE
    assert 0 < short.bound <= longer.objective <= short.objective == short.price
    assert short.gap == pytest.approx((short.price - short.bound) / short.price)
    assert problem.value(short.chosen) >= 0.6 * 300


def test_an_unproven_number_of_sensors_that_cost_nothing_has_a_note():
    problem = hard_problem(60, 300, count=None, prices=np.zeros(60))
    short = finish(cheapest_for_share(problem, 0.6, SolverLimits(effort=1e-6)))
    assert (short.status, short.notes[0], short.bound) == ("feasible", UNPROVEN_NUMBER, 0.0)
    few = hard_problem(8, 40, count=None, prices=np.zeros(8))
    best = finish(cheapest_for_share(few, 0.3))
    assert best.status == "optimal"
    fewer = itertools.combinations(range(8), len(best.chosen) - 1)
    assert all(few.value(np.array(chosen, dtype=np.int64)) < 0.3 * 40 for chosen in fewer)


def test_accepted_search_ends_at_once_with_a_placement_that_reaches_the_share():
    problem, acceptance = hard_problem(60, 300, count=None), Acceptance()
    steps = cheapest_for_share(problem, 0.6, SolverLimits(effort=1e6, acceptance=acceptance))
    placement, number = None, 0
    while placement is None:
        try:
            next(steps)
        except StopIteration as end:
            placement = end.value
        number += 1
        if number == 150:
            acceptance.accept()
    assert number < 150 + 130  # the bound on the price takes 100
    assert problem.value(placement.chosen) >= 0.6 * 300


def test_same_inputs_give_the_same_bits():
    problem = replace(hard_problem(40, 200), count=None)
    first, again = (finish(cheapest_for_share(problem, 0.5, SolverLimits(effort=0.2))) for _ in range(2))
    assert first.chosen.tolist() == again.chosen.tolist()
    assert (first.objective, first.bound, first.notes) == (again.objective, again.bound, again.notes)
