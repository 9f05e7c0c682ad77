"""The benchmark writes its page, charts and figures; what it compares is what it says."""

import json
import math

from headless.studies.benchmark import command as benchmark
from headless.studies.benchmark.baselines import BASELINES, can_run
from headless.studies.benchmark.measurements import BenchmarkScope
from headless.studies.benchmark.placement import SolverRun, compare
from headless.studies.benchmark.report import bars
from headless.studies.benchmark.resource_usage import Expense
from headless.studies.benchmark.scans import ScanCost
from headless.studies.benchmark.street_visibility import street_problem
from headless.studies.benchmark.visibility import Cost

import pytest

from seip_addon.core.site.candidates import CandidateSettings

SMALL = BenchmarkScope(
    layout=CandidateSettings(sensors=("type1",), heights=(3.5,), spacing=24.0),
    street=(20, 200, 2),
    counts=(2, 3),
    largest=(16, 300, 2),
    places=1,
    multiples=(1, 2),
    copies=(1, 2),
    spacings=(8.0, 4.0),
    scanned_by="type1",
    frames=1,
    modelled="vlp16",
    placements=3,
    every_beam=1,
)


@pytest.fixture(scope="module")
def folder(small_scene, tmp_path_factory):
    pytest.importorskip("embreex", reason="embreex is not installed")
    folder = tmp_path_factory.mktemp("benchmark")
    work = ["--steps", "2", "--work", str(folder / "work")]
    benchmark.main([str(small_scene), "-o", str(folder), "--places", "1", "--effort", "5", *work], SMALL)
    return folder


@pytest.mark.slow
def test_the_page_shows_charts_that_are_there(folder):
    page = (folder / "benchmark.md").read_text(encoding="utf-8")
    for chart in ("visibility", "placement", "growth", "sensor_models"):
        assert f"(benchmark/{chart}.png)" in page
        assert (folder / "benchmark" / f"{chart}.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_figures_hold_every_way(folder):
    record = json.loads((folder / "benchmark" / "benchmark.json").read_text(encoding="utf-8"))
    assert {"full bvh", "lazy bvh", "full embree", "lazy embree"} <= set(record["visibility"])
    assert len(record["visibility"]) == 2 * (2 + len(record["harm"]) - 1)
    assert record["visibility"]["lazy embree"]["rays"] < record["visibility"]["full embree"]["rays"]
    assert record["harm"]["exact"]["wrong"] == 0 < record["harm"]["azimuth ÷ 8"]["wrong"]
    ways = {run["way"] for run in record["placement"]}
    assert ways == {way for way in BASELINES if can_run(way)}
    assert len(record["bars"]) == 9
    assert record["scans"]["cached embree"]["rays"] == record["scans"]["full bvh"]["rays"] == 4 * 60_000
    assert all(len(growth["seconds"]) == len(growth["size"]) for growth in record["growth"])

    assert "first linear relaxation" in {growth["what"] for growth in record["growth"]}


@pytest.mark.slow
def test_placement_alone_is_measured_again(folder, small_scene):
    figures = folder / "benchmark" / "benchmark.json"
    before = json.loads(figures.read_text(encoding="utf-8"))
    options = ["-o", str(folder), "--only", "placement", "--effort", "4", "--work", str(folder / "work")]
    benchmark.main([str(small_scene), *options], SMALL)
    after = json.loads(figures.read_text(encoding="utf-8"))
    changed = {name for name in after if after[name] != before[name]}
    assert {"setting", "placement", "growth"} <= changed <= {"setting", "placement", "growth", "bars"}
    assert after["setting"] == {**before["setting"], "effort": 4.0}
    assert [(one["what"], one["size"]) for one in after["growth"]] == [
        (one["what"], one["size"]) for one in before["growth"]
    ]
    assert after["growth"][0] == before["growth"][0]


def test_every_way_to_place_keeps_to_the_rules_and_none_beats_a_bound():
    problem = street_problem(20, 300, blocks=2, count=3)
    ways = [way for way in BASELINES if can_run(way)]
    runs = {run.way: run for run in compare("streets", problem, ways, 20)}
    best = runs["ours"]
    assert best.proven
    for run in runs.values():
        assert run.objective <= best.objective + 1e-6 <= run.bound + 2e-6
    assert runs["PuLP + CBC"].objective == runs["PuLP + HiGHS"].objective == best.objective
    assert runs["lazy greedy"].objective == runs["greedy"].objective <= runs["local search"].objective


def run_of(instance, way, seconds, objective, bound):
    return SolverRun(instance, way, Expense(seconds, seconds), 100.0, objective, bound, min(bound, 1000.0), "")


def test_bars_are_met_by_what_meets_them_alone():
    costs = {
        "full bvh": Cost(Expense(100.0), 1, 1),
        "lazy bvh": Cost(Expense(5.0), 1, 1),
        "full embree": Cost(Expense(9.0), 1, 1),
        "lazy embree": Cost(Expense(1.0), 1, 1),
    }
    runs = [
        run_of("few", "PuLP + CBC", 30.0, 900.0, 900.0),
        run_of("few", "ours", 1.0, 900.0, 900.0),
        run_of("many", "ours", 59.0, 991.0, 1000.0),
        run_of("largest", "ours", 119.0, 984.0, 1000.0),
    ]
    scans = {
        "cached bvh": ScanCost(Expense(7.0), 10, 1_000_000, 1),
        "full bvh": ScanCost(Expense(100.0), 10, 1_000_000),
        "cached embree": ScanCost(Expense(5.0), 10, 1_000_000, 0),
    }
    held = bars(costs, runs, ("few", "many", "largest"), scans)
    assert [bar.met for bar in held] == [True, True, False, True, True, False, False, True, True]
    assert held[2].measured == "9×"
    runs[0] = run_of("few", "PuLP + CBC", 30.0, 901.0, math.inf)  # better than what was said to be proven
    scans["cached bvh"].differing = 2
    held = bars(costs, runs, ("few", "many", "largest"), scans)
    assert not held[3].met
    assert not held[8].met
