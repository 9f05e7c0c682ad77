"""At real sites, a search of 25 lines finds nothing better in the same processor time."""

import math
import time

import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.solver import solve
from tests.oracles.placement_faults import problem_of
from tests.oracles.plain_search import plain_search
from tests.sumo_here import needs_sumo

pytest.importorskip("bpy")
from tests.oracles.real_placement_problems import SITES, real_cases


def _sites():
    for name, site in SITES.items():
        source, _ = site.place
        there = pytest.mark.skipif(not source.exists(), reason=f"{source.name} is not there: see SEIP_MAPS")
        yield pytest.param(site, id=name, marks=[there, *([needs_sumo] if source.suffix == ".osm" else [])])


@pytest.mark.long
@pytest.mark.parametrize("site", list(_sites()))
def test_a_plain_search_finds_nothing_better(site, tmp_path):
    for case in real_cases(site, tmp_path):
        problem = problem_of(case)
        start = time.process_time()
        placement = finish(solve(problem))
        seconds = time.process_time() - start
        value = case.value(placement.chosen)
        assert placement.objective == pytest.approx(value, rel=1e-12)
        assert problem_limits_hold(case, placement.chosen)
        plain = max(found.value for found in plain_search(case, seconds) if found.seconds <= seconds)
        assert plain <= value * (1 + 1e-9)


def problem_limits_hold(case, chosen):
    return (
        (case.count is None or len(chosen) <= case.count)
        and math.fsum(case.prices[chosen]) <= case.budget * (1 + 1e-9)
        and len(set(case.positions[chosen].tolist())) == len(chosen)
    )
