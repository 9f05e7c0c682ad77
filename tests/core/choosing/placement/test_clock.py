"""Limits of time and of counted work."""

import math
from itertools import count

from headless.studies.benchmark.street_visibility import street_problem

import pytest

from seip_addon.core.choosing.placement import search_limits
from seip_addon.core.choosing.placement.search_limits import OPERATIONS_PER_UNIT, Clock
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.progress import finish


def test_what_a_part_spends_is_spent_of_the_whole() -> None:
    whole = Clock(math.inf, 10.0)
    part = whole.part(4.0)
    part.spend(3 * OPERATIONS_PER_UNIT)
    assert (part.left, whole.left) == (pytest.approx(1.0, rel=2e-3), pytest.approx(7.0, rel=1e-3))
    assert whole.part(100.0).left == whole.left
    assert whole.part(0.0, least=2.0).left == 2.0


def test_without_any_limit_given_a_search_is_limited_by_work_and_never_by_time(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = street_problem(60, 800, heights=1, count=6)
    alone = finish(solve(problem))
    ticks = count(0.0, 1000.0)  # a machine on which any step takes a quarter of an hour
    monkeypatch.setattr(search_limits.time, "perf_counter", lambda: next(ticks))
    loaded = finish(solve(problem))
    first, second = ((one.status, one.bound, one.chosen.tolist(), one.notes) for one in (alone, loaded))
    assert first == second
