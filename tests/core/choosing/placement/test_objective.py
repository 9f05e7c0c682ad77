"""A goal becomes the problem that it states, or one sentence."""

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.objective import Objective, check_objective, placement_problem, target_weights
from seip_addon.core.workflows.placing import optimise


def problem(example, **goal):
    return placement_problem(example.site, example.visible, example.models, Objective(**goal))


def test_weights_count_in_the_weighted_problem_alone(example):
    central = example.site.targets.central
    assert set(target_weights(example.site, Objective())) == {1.0}
    assert set(target_weights(example.site, Objective(central_weight="scene"))[central]) == {2.0}
    weights = target_weights(example.site, Objective(central_weight=7.5))
    assert set(weights[central]) == {7.5}
    assert set(weights[~central]) == {1.0}


def test_demands_by_name_are_met(example):
    names = example.site.candidates.position_name.tolist()
    goal = Objective(count=3, mandatory=(names[0],), forbidden=tuple(names[5:]))
    placement = finish(optimise(example.site, example.visible, example.models, goal)).placement
    chosen = {names[example.site.candidates.position_of[pose]] for pose in placement.chosen}
    assert names[0] in chosen
    assert chosen <= set(names[:5])


@pytest.mark.parametrize(
    ("goal", "sentence"),
    [
        ({"coverage": 0.0}, "share above 0 and at most 1"),
        ({"central_weight": -1.0}, "central weight must be 1e-06 to 1,000,000, not -1"),
        ({"budget": float("inf")}, "budget must be 0 to"),
        ({"forbidden": ("a",), "mandatory": ("a",)}, "'a' is both forbidden and mandatory"),
        ({"mandatory": ("signal pole 9",)}, "did you mean 'signal pole"),
        ({"count": 10_000}, "10000 sensors are requested, but"),
        ({"budget": 10.0}, "below the cheapest sensor"),
    ],
)
def test_each_fault_has_its_sentence(example, goal, sentence):
    with pytest.raises(SeipError, match=sentence):
        check_objective(example.site, example.models, Objective(**goal))


def test_the_weighted_problem_needs_a_weighted_region(example):
    site = example.site
    targets = type(site.targets)(site.targets.xyz, site.targets.weight, np.zeros(len(site.targets), bool), 1.0)
    bare = type(site)(site.name, site.origin, site.region, targets, site.candidates, site.triangles, site.reflectivity)
    with pytest.raises(SeipError, match="needs a weighted region"):
        target_weights(bare, Objective(central_weight=2.0))
