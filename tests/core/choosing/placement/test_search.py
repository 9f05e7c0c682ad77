"""The search by itself, which knows no bound but the rank of candidates."""

import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement import search
from seip_addon.core.choosing.placement.feasibility import serving_choice
from seip_addon.core.choosing.placement.incumbent import Incumbent
from seip_addon.core.choosing.placement.instance import make_instance
from seip_addon.core.choosing.placement.search_limits import Work
from tests.builders.placement_problems import all_choices, random_problem


@pytest.mark.parametrize("returns", [False, True], ids=["coverage", "returns"])
def test_restarts_among_few_candidates_find_the_best_placement(monkeypatch, returns):
    monkeypatch.setattr(search, "LEAST_CORE", 4)
    monkeypatch.setattr(search, "CORE_STEPS", (0.0, 8.0))
    compared = 0
    for seed in range(20):
        instance = make_instance(random_problem(seed, returns=returns))
        choices = all_choices(instance)
        if not choices:
            continue
        incumbent = Incumbent(instance, Work(1.0))
        searched = search.Search(incumbent, finish(serving_choice(instance, "auto")))
        finish(searched.first())
        finish(searched.restarts(0.2, np.random.default_rng(seed).random(len(instance))))
        assert instance.feasible(incumbent.chosen)
        assert incumbent.value == pytest.approx(max(map(instance.value, choices)), abs=2 * instance.slack)
        compared += 1
    assert compared > 12


def test_a_core_has_the_best_placement_and_all_mandatory_candidates(monkeypatch):
    monkeypatch.setattr(search, "LEAST_CORE", 1)
    monkeypatch.setattr(search, "CORE_STEPS", (0.0,))
    for seed in range(20):
        instance = make_instance(random_problem(seed))
        incumbent = Incumbent(instance, Work(1.0))
        searched = search.Search(incumbent, np.zeros(0, dtype=np.int64))
        finish(searched.first())
        (core,) = searched.cores(np.arange(len(instance), 0.0, -1.0))
        assert np.isin(incumbent.chosen, core.among).all()
        assert np.isin(np.flatnonzero(instance.mandatory.any(axis=0)), core.among).all()
        assert 0 in core.among
