"""Drawing placements, the criteria beside coverage, and what is kept of a study."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless.studies.criteria.pose_criteria import SeenShare
from headless.studies.criteria.site_criteria import best_of, problem_of

import numpy as np

from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.search_limits import DEFAULT_LIMITS
from tests.builders.small_junction import make_example


@pytest.fixture(scope="module")
def survey():
    """A survey of one type, with visibility by plain lines of sight."""
    example = make_example(spacing=4.0, heights=(5.4,))
    candidates = example.site.candidates
    kept = np.flatnonzero(candidates.sensor == "type2")
    columns = {
        name: getattr(candidates, name)[kept] for name in ("position_of", "sensor", "height", "xyz", "yaw", "tilt")
    }
    return SimpleNamespace(
        site=replace(example.site, candidates=replace(candidates, **columns)),
        models={"type2": example.models["type2"]},
        grid=SimpleNamespace(visible=example.visible[kept]),
        settings=SimpleNamespace(limits=DEFAULT_LIMITS),
    )


@pytest.mark.parametrize("key", ["coverage", "occupancy_entropy"])
def test_what_coverage_rates_best_is_proven_optimal(survey, key):
    """Of all pairs: a greedy choice would be another, worse one."""
    visible, weight = survey.grid.visible, np.ones(len(survey.site.targets))
    criterion = SeenShare(key, key, visible, weight)
    problem = problem_of(survey, 2)
    found = finish(best_of(criterion, survey, problem))
    position = survey.site.candidates.position_of
    best = max(
        (visible[a] | visible[b]).mean() for a in range(len(visible)) for b in range(a) if position[a] != position[b]
    )
    assert criterion.value(found) == pytest.approx(best)
