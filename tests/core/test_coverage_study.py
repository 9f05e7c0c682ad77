"""The study solves every cell, and its verdicts follow from the figures."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from small_junction import make_example

from seip_addon.core.coverage_study import NUMBERS, WEIGHTS, CoverageStudy, coverage_study, judge
from seip_addon.core.pictures.study_charts import save_claims, save_height_chart, save_study_table, save_weight_chart
from seip_addon.core.progress import finish


@pytest.fixture(scope="module")
def example():
    return make_example(spacing=3.0)


@pytest.fixture(scope="module")
def study(example):
    return finish(coverage_study(example.site, example.models, example.visible))


def test_every_cell_is_solved_within_its_own_type_and_height(example, study):
    sensors, heights = len(study.sensors), len(study.heights)
    assert len(study.cases) == sensors * len(NUMBERS) * (heights + 1 + len(WEIGHTS))
    candidates = example.site.candidates
    for case in study.cases:
        assert set(candidates.sensor[case.placement.chosen]) == {case.sensor}
        if case.height is not None:
            assert set(candidates.height[case.placement.chosen]) == {case.height}
        assert len(case.placement.chosen) <= case.count


def test_free_heights_are_no_worse_than_any_one_height(study):
    for sensor in study.sensors:
        for count in NUMBERS:
            free = study.case(sensor, count).placement
            for height in study.heights:
                assert free.bound >= study.case(sensor, count, height).placement.objective


def test_the_objective_counts_targets(example, study):
    case = study.case(study.sensors[0], 2)
    seen = example.visible[case.placement.chosen].any(axis=0)
    assert case.placement.objective == seen.sum()
    assert case.deployment.coverage == seen.mean()


def test_greedy_keeps_its_promise(study):
    claim = next(claim for claim in judge(study) if claim.number == 10)
    assert claim.verdict == "holds"


@dataclass(frozen=True)
class _Answer:
    objective: float
    bound: float
    chosen: tuple[int, ...]


@dataclass(frozen=True)
class _View:
    coverage: float
    central: float


def told(study, change):
    """The study with each vanilla cell's answer replaced by ``change(case) -> (low, high, sensors used)``."""
    cases = []
    for case in study.cases:
        low, high, used = change(case)
        answer = _Answer(low * study.targets, high * study.targets, tuple(range(used)))
        cases.append(replace(case, placement=answer, deployment=_View(low, low)))
    return CoverageStudy(study.sensors, study.heights, tuple(cases), study.targets)


def verdict(study, number):
    return next(claim.verdict for claim in judge(study) if claim.number == number)


def test_claim_2_needs_all_targets_and_a_sensor_to_spare(study):
    assert verdict(told(study, lambda case: (1.0, 1.0, 3)), 2) == "holds"
    assert verdict(told(study, lambda case: (1.0, 1.0, 4)), 2) == "does not hold"
    assert verdict(told(study, lambda case: (0.97, 0.97, 3)), 2) == "does not hold"
    assert verdict(told(study, lambda case: (0.97, 1.0, 3)), 2) == "undecided"


def test_claim_3_follows_the_heights(study):
    lowest = study.heights[0]

    def as_claimed(case):
        likes_low = case.sensor == study.sensors[0]
        share = 0.6 if (case.height == lowest) == likes_low else 0.5
        return share, share, 1

    assert verdict(told(study, as_claimed), 3) == "holds"
    assert verdict(told(study, lambda case: (0.5, 0.6, 1)), 3) == "undecided"
    assert verdict(told(study, lambda case: (1.1 - as_claimed(case)[0],) * 2 + (1,)), 3) == "does not hold"


def test_claim_4_weighs_gain_against_loss(study):
    def weighted(gain, loss, best_gain):
        def change(case):
            on = case.weight != 1.0
            best = case.sensor == study.sensors[-1]
            return 0.5 - loss * on, 0.5 + on * (best_gain if best else gain), 1

        cases = told(study, change)
        views = [replace(c, deployment=_View(c.placement.objective / study.targets, c.placement.bound / study.targets))
                 for c in cases.cases]  # fmt: skip
        return verdict(replace(cases, cases=tuple(views)), 4)

    assert weighted(gain=0.1, loss=0.0, best_gain=0.0) == "holds"
    assert weighted(gain=0.1, loss=0.2, best_gain=0.0) == "does not hold"
    assert weighted(gain=0.0, loss=0.0, best_gain=0.0) == "does not hold"
    assert weighted(gain=0.1, loss=0.0, best_gain=0.1) == "does not hold"


def test_pictures_and_tables_are_the_same_bytes_each_time(study, example, tmp_path):
    heights = example.site.candidates.height.tolist()
    for name in ("one", "two"):
        folder = tmp_path / name
        save_height_chart(folder / "heights.png", study, "Small junction")
        save_weight_chart(folder / "weights.png", study, "Small junction")
        save_study_table(folder / "coverage.csv", study, heights)
        save_claims(folder / "claims.md", judge(study), "Small junction")
    for path in (tmp_path / "one").iterdir():
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes()
    table = np.genfromtxt(tmp_path / "one" / "coverage.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    assert len(table) == len(study.cases)
