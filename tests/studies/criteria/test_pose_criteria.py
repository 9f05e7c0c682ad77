"""Criteria of sets of poses, on cases whose values are worked out by hand."""

import math
from dataclasses import replace
from types import SimpleNamespace

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless.studies.criteria.pose_criteria import (
    InfrastructureScore,
    SeenShare,
    VehicleGridEntropy,
    best_by_greed,
    entropy_guided_visibility,
)
from headless.studies.criteria.site_criteria import best_of, problem_of
from headless.studies.criteria.vehicle_grid import VIEW_CELLS

import numpy as np

from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.problem import PlacementProblem
from seip_addon.core.choosing.placement.search_limits import DEFAULT_LIMITS
from tests.builders.small_junction import make_example


def poses(*chosen):
    return np.array(chosen, dtype=np.int64)


def problem(positions, count, mandatory=None):
    number = len(positions)
    return PlacementProblem(
        amounts=np.ones((number, 1), dtype=bool),
        weights=np.ones(1),
        prices=np.ones(number),
        positions=np.array(positions),
        xyz=np.arange(3.0 * number).reshape(-1, 3),
        labels=np.full(number, "type1"),
        count=count,
        mandatory=mandatory,
    )


def test_egvs_is_the_entropy_of_the_voxels_that_beams_pass():
    """Voxels occupied half of the time, a quarter of it and never: of 1.811 bits the poses pass 1 and 0.811."""
    passed = np.array([[1, 0, 1], [0, 1, 1]], dtype=bool)
    criterion = entropy_guided_visibility(passed, np.array([0.5, 0.25, 0.0]))
    quarter = 2 - 0.75 * math.log2(3)
    assert criterion.value(poses(0)) == pytest.approx(1 / (1 + quarter))
    assert criterion.value(poses(1)) == pytest.approx(quarter / (1 + quarter))
    assert criterion.value(poses(0, 1)) == pytest.approx(1)


def test_inspe_is_the_mean_of_coverage_what_is_not_occluded_and_information():
    """Of four voxels a pose covers two and is left one at one instant, two at the other; another covers a third."""
    criterion = InfrastructureScore(
        covered=np.array([[1, 1, 0, 0], [0, 0, 1, 0]], dtype=bool),
        free=np.array([[1, 1, 0, 0], [0, 0, 0, 0]], dtype=bool),
        unhidden=np.array([[[1, 0, 0, 0], [0, 0, 0, 0]], [[1, 1, 0, 0], [0, 0, 0, 0]]], dtype=bool),
        information=np.array([1.0, 0.0, 0.5, 0.5]),
    )
    assert criterion.value(poses(0)) == pytest.approx((2 / 4 + (1 / 2 + 2 / 2) / 2 + 1 / 2) / 3)
    assert criterion.value(poses(1)) == pytest.approx((1 / 4 + 0 + 0) / 3)
    assert criterion.value(poses(0, 1)) == pytest.approx((3 / 4 + (1 / 3 + 2 / 3) / 2 + 1 / 2) / 3)


def test_pe_vgop_is_the_entropy_of_the_share_of_occupied_cells_by_view():
    """A quarter of the top view is hit for certain; a pose with chance 1/2 in all of the side view fills it to 1/2."""
    top, side, front = VIEW_CELLS
    log_miss = np.zeros((2, 1, top + side + front), dtype=np.float32)
    log_miss[0, 0, : top // 4] = -30
    log_miss[1, 0, top : top + side] = math.log(0.5)
    criterion = VehicleGridEntropy(log_miss)
    quarter = 2 - 0.75 * math.log2(3)
    assert criterion.value(poses(0)) == pytest.approx(quarter / 3, abs=1e-6)
    assert criterion.value(poses(1)) == pytest.approx(1 / 3, abs=1e-6)
    assert criterion.value(poses(0, 1)) == pytest.approx((quarter + 1) / 3, abs=1e-6)


def test_swaps_mend_a_greedy_choice():
    """Greed takes the pose that sees four of six targets first; the two that see three each are the best pair."""
    seen = np.array([[1, 1, 0, 1, 1, 0], [1, 1, 1, 0, 0, 0], [0, 0, 0, 1, 1, 1]], dtype=bool)
    criterion = SeenShare("c", "c", seen, np.ones(6))
    assert finish(best_by_greed(criterion, problem([0, 1, 2], 1))).tolist() == [0]
    assert finish(best_by_greed(criterion, problem([0, 1, 2], 2))).tolist() == [1, 2]


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
