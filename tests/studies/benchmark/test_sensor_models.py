"""Models of one LiDAR side by side: beams that diverge, random placements, and what each model changes."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

from headless.studies.benchmark import report
from headless.studies.benchmark.resource_usage import Expense
from headless.studies.benchmark.sensor_models import (
    FINEST,
    PLAIN,
    SHIPPED,
    SUB_RAYS,
    DivergentCaster,
    PrecisionFront,
    SensorModelFindings,
    SiteFront,
    best_placement,
    random_placements,
    sensor_models,
    site_front,
)
from headless.studies.benchmark.sensor_report import differs, save_sensor_model_chart, sensor_model_parts
from headless.studies.benchmark.visibility import Cost

import bpy
import numpy as np
import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.estimates import IntervalEstimate
from seip_addon.core.progress import finish
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scans.sensor import MountedSensor, level_orientation
from seip_addon.core.sensing.scans.simulation import ScanSettings, prepare
from seip_addon.core.sensing.scans.static_scene import static_scene
from seip_addon.core.sensing.traffic.bodies import fitted_body
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from tests.builders.small_junction import ORIGIN, box_triangles, make_example
from tests.builders.small_scene import make_run

assert bpy.app.version  # the engine bvh needs Blender's module, which is there from here on

DOCS = Path(__file__).parents[3] / "docs"
LIDAR = replace(load_catalogue()["os1_128"], points_per_second=2_621_440 / 8)
AHEAD = np.array([[1.0, 0.0, 0.0]])
WALL = box_triangles((10, -20, -20), (11, 20, 20))


def beam(*obstacles, along=AHEAD, divergence=0.035):
    """Cast a beam from the origin, which is 0.35 m wide at the wall; return its range, and whether it hits the wall."""
    caster = DivergentCaster(make_ray_caster(np.concatenate([WALL, *obstacles])), divergence)
    distance, triangle = caster.cast(np.zeros(3), along, 100.0)
    return float(distance[0]), int(triangle[0])


def test_a_beam_ends_where_most_of_its_rays_do():
    facing, triangle = beam()
    assert facing == pytest.approx(10.0, abs=1e-4)
    assert 0 <= triangle < len(WALL)
    speck = box_triangles((5, -0.02, -0.02), (5.1, 0.02, 0.02))  # stops the axis alone
    assert beam(speck)[0] == pytest.approx(10.0, abs=1e-4)
    pole = box_triangles((5, -0.02, -9), (5.1, 0.02, 9))  # stops the axis and the rays above and below
    assert beam(pole)[0] == pytest.approx(5.0, abs=1e-4)
    beside = box_triangles((5, 0.01, -9), (5.1, 9, 9))  # stops one of five
    assert beam(beside)[0] == pytest.approx(10.0, abs=1e-4)


def test_a_beam_meets_a_plane_where_its_axis_does():
    road = box_triangles((-200, -200, -5.1), (200, 200, -5))
    for along in ((0.6, 0.0, -0.8), (0.0, 0.0, -1.0), (0.05, 0.3, -math.sqrt(1 - 0.0925))):
        distance, _ = beam(road, along=np.array([along]), divergence=math.radians(0.2))
        assert distance == pytest.approx(-5 / along[2], rel=1e-5)
    assert beam(along=-AHEAD) == (math.inf, -1)


def test_beams_from_many_points_are_the_beams_of_each():
    caster = DivergentCaster(make_ray_caster(WALL), 0.01)
    starts = np.array([[0.0, 0.0, 0.0], [4.0, 1.0, 2.0]])
    together, _ = caster.cast(starts, np.repeat(AHEAD, 2, axis=0), 100.0)
    np.testing.assert_allclose(together, (10.0, 6.0), atol=1e-4)


def test_random_placements_have_different_positions_and_follow_the_seed():
    candidates = make_example().site.candidates
    drawn = random_placements(candidates, 4, 30, seed=3)
    assert all(len(set(candidates.position_of[one])) == 4 for one in drawn)
    assert len(np.unique(np.concatenate(drawn))) > 30
    for one, again in zip(drawn, random_placements(candidates, 4, 30, seed=3), strict=True):
        np.testing.assert_array_equal(one, again)
    assert any((one != other).any() for one, other in zip(drawn, random_placements(candidates, 4, 30, 4), strict=True))


def own_site():
    site = make_example(spacing=4.0, reach=36.0, heights=(5.4,)).site
    one = site.candidates.sensor == "type1"
    parts = {name: getattr(site.candidates, name)[one] for name in ("position_of", "height", "xyz", "yaw", "tilt")}
    return replace(site, candidates=replace(site.candidates, sensor=np.full(one.sum(), LIDAR.key), **parts))


@pytest.fixture(scope="module")
def front():
    pytest.importorskip("embreex", reason="embreex is not installed")
    amount = {"counts": (1, 2), "placements": 5, "checked": 3, "seed": 0, "time_limit": 10.0}
    return site_front(own_site(), sensor_models(LIDAR), **amount)


def test_every_model_sees_the_same_placements(front):
    assert list(front.costs) == [PLAIN, SHIPPED, FINEST]
    assert all(len(front.coverage[name][n]) == 5 for name in front.costs for n in ("1", "2"))
    for plain, shipped in zip(front.coverage[PLAIN]["2"], front.coverage[SHIPPED]["2"], strict=True):
        assert plain >= shipped  # the law takes returns away and adds none
    assert front.costs[PLAIN].seen > front.costs[SHIPPED].seen > 0
    assert front.costs[FINEST].rays % SUB_RAYS == 0
    assert front.costs[FINEST].rays > 3 * front.costs[SHIPPED].rays
    assert front.differing <= 0.01 * front.compared
    claimed, true = front.best[FINEST]["2"]
    assert claimed == true >= front.best[PLAIN]["2"][1]


def test_more_sensors_than_positions_are_refused():
    amount = {"placements": 1, "checked": 1, "seed": 0, "time_limit": 1.0}
    with pytest.raises(SeipError, match="position"):
        site_front(own_site(), sensor_models(LIDAR), counts=(1, 999), **amount)


def test_the_best_placement_covers_most():
    site, random = own_site(), np.random.default_rng(1)
    visible = random.random((len(site.candidates), len(site.targets))) < 0.1
    chosen = best_placement(site, {LIDAR.key: LIDAR}, visible, 2, 10.0)
    pairs = [(a, b) for a in range(len(visible)) for b in range(a)]
    assert visible[chosen].any(axis=0).sum() == max((visible[a] | visible[b]).sum() for a, b in pairs)


def by_hand(site="a", shipped=(0.25, 0.35)):
    coverage = {PLAIN: {"1": [0.5, 0.7]}, SHIPPED: {"1": list(shipped)}, FINEST: {"1": [0.2, 0.3]}}
    costs = {
        name: Cost(Expense(seconds, seconds), 10, 5) for name, seconds in zip(coverage, (1.0, 2.0, 4.0), strict=True)
    }
    best = {name: {"1": (0.5, 0.4)} for name in coverage}
    return SiteFront(site, 100, 8, costs, coverage, best, 1, 900)


def precision_by_hand():
    estimates = {name: IntervalEstimate(0.8, 0.7, math.inf) for name in (PLAIN, SHIPPED, FINEST)}
    changes = {PLAIN: IntervalEstimate(0.1, 0.05, 0.2), SHIPPED: IntervalEstimate(0.01, -0.02, 0.03)}
    changes[FINEST] = IntervalEstimate(0.0, 0.0, 0.0)
    return PrecisionFront("a", "4 × os1_128", 60, 1800, by_hand().costs, estimates, changes)


def test_changes_are_paired():
    change = by_hand().change(PLAIN)
    assert change.value == pytest.approx(0.35)
    assert 0.3 <= change.low <= change.value <= change.high <= 0.4 + 1e-12
    assert differs(change)
    same = by_hand(shipped=(0.25, 0.25)).change(SHIPPED, "1")  # once more, once less
    assert same.value == pytest.approx(0.0)
    assert not differs(same)
    assert by_hand().change(FINEST) == IntervalEstimate(0.0, 0.0, 0.0)


def test_sites_stay_until_they_are_measured_again():
    earlier = SensorModelFindings("os1_128", 0.003, 16, (by_hand("a"), by_hand("b")), precision_by_hand())
    again = by_hand("b", shipped=(0.9, 0.9))
    joined = SensorModelFindings("os1_128", 0.003, 16, (again, by_hand("c"))).over(earlier)
    assert [one.site for one in joined.sites] == ["a", "b", "c"]
    assert joined.sites[1] is again
    assert joined.precision is earlier.precision
    other = SensorModelFindings("os0_128", 0.006, 16, (again,))
    assert other.over(earlier) is other
    assert other.over(None) is other


def test_the_chapter_says_what_was_measured(tmp_path):
    findings = SensorModelFindings("os1_128", math.radians(0.18), 2, (by_hand(),), precision_by_hand())
    heading, text, picture, table, verdict = sensor_model_parts(findings, "benchmark")
    assert heading == "## Models of the sensor"
    assert "0.18°" in text
    assert "1,800 steps" in text
    assert "(benchmark/sensor_models.png)" in picture
    assert "| a | plain range | 1 | 10 | 60.0% (+35.00 [" in table
    assert "by 35.0 to 35.0 points" in verdict
    assert "takes 2 times as long" in verdict
    assert "is left out" not in verdict  # five points are not nothing
    save_sensor_model_chart(tmp_path, findings)
    assert (tmp_path / "sensor_models.png").read_bytes().startswith(b"\x89PNG")
    quiet = replace(findings, sites=(by_hand(shipped=(0.2, 0.301)),))
    assert "it is left out" in sensor_model_parts(quiet, "benchmark")[-1]


def test_the_shipped_page_is_that_of_its_figures(tmp_path):
    findings, checks = report.load_json(DOCS / "benchmark" / "benchmark.json")
    report.save_page(tmp_path / "page.md", findings, checks, "benchmark")
    assert (tmp_path / "page.md").read_text(encoding="utf-8") == (DOCS / "benchmark.md").read_text(encoding="utf-8")


def test_figures_are_read_as_they_were_written(tmp_path):
    findings, checks = report.load_json(DOCS / "benchmark" / "benchmark.json")
    models = SensorModelFindings("os1_128", 0.003, 2, (by_hand(),), precision_by_hand())
    report.save_json(tmp_path / "one.json", replace(findings, sensor_models=models), checks)
    read, _ = report.load_json(tmp_path / "one.json")
    assert read.sensor_models.precision.precision[PLAIN] == IntervalEstimate(0.8, 0.7, math.inf)
    report.save_json(tmp_path / "two.json", read, checks)
    assert (tmp_path / "two.json").read_bytes() == (tmp_path / "one.json").read_bytes()


@pytest.mark.parametrize("text", ["", "{", "[]", json.dumps({"bars": []})])
def test_what_is_no_benchmark_is_refused(tmp_path, text):
    (tmp_path / "benchmark.json").write_text(text, encoding="utf-8")
    with pytest.raises(SeipError, match="is not a benchmark"):
        report.load_json(tmp_path / "benchmark.json")


def test_frames_by_the_shipped_model_are_the_product_s_own():
    pytest.importorskip("torch", reason="torch is not installed")
    from headless.detection.recordings import SampledRun  # noqa: PLC0415 -- needs torch
    from headless.studies.benchmark.sensor_precision import frames_by  # noqa: PLC0415 -- as above

    static = static_scene(make_example(reach=36.0).geometry)
    sensor = MountedSensor("S1", LIDAR, np.array([9.0, -9.0, 5.4]), level_orientation(2.3))
    traffic = make_run(1, 10.0).moved_to(ORIGIN)
    run = SampledRun("run", traffic, np.array([4.0, 6.0]))
    bodies = [fitted_body(user) for user in traffic.users]
    simulation = finish(prepare(static, [sensor], traffic, bodies, ScanSettings(seed=5)))
    costs = {}
    for model in sensor_models(LIDAR):
        cost = costs[model.name] = Cost()
        frames = [frame for _, frame in frames_by(model, static, [sensor], [run], seed=5, cost=cost)]
        if model.name == SHIPPED:
            for number, (frame, time) in enumerate(zip(frames, run.times, strict=True)):
                own = simulation.frame(number, float(time))
                np.testing.assert_array_equal(frame.points, own.points)
                np.testing.assert_array_equal(frame.intensity, own.intensity)
    assert costs[PLAIN].seen > costs[SHIPPED].seen > 0
    assert costs[FINEST].seen == pytest.approx(costs[SHIPPED].seen, rel=0.02)
    assert costs[FINEST].rays == SUB_RAYS * costs[SHIPPED].rays
