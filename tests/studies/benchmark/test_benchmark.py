"""The benchmark writes its page, its methods keep to the rules, and its requirements are strict."""

import math
import re
from dataclasses import replace

from headless.studies.benchmark import command as benchmark
from headless.studies.benchmark.command import BenchmarkScope
from headless.studies.benchmark.placement import METHODS, SolverRun, compare
from headless.studies.benchmark.report import Findings, requirements
from headless.studies.benchmark.resource_usage import Expense
from headless.studies.benchmark.scans import ScanCost
from headless.studies.benchmark.street_visibility import street_problem
from headless.studies.benchmark.visibility import Cost

import pytest

from seip_addon.core.site.candidates import CandidateSettings

SMALL = BenchmarkScope(
    layout=CandidateSettings(sensors=("type1",), heights=(3.5,), spacing=24.0),
    effort=5.0,
    positions=1,
    street=(20, 200, 2),
    counts=(2, 3),
    largest=(16, 300, 2),
    scanned_by="type1",
    frames=1,
)


@pytest.mark.slow
def test_the_page_has_every_method(small_scene, tmp_path):
    pytest.importorskip("embreex", reason="embreex is not installed")
    benchmark.main([str(small_scene), "-o", str(tmp_path)], SMALL)
    page = (tmp_path / "benchmark.md").read_text(encoding="utf-8")
    assert len(re.findall(r"\| (?:met|\*\*not met\*\*) \|", page)) == 9
    for method in ("full bvh", "lazy bvh", "full embree", "lazy embree", "cached bvh", "cached embree"):
        assert f"\n| {method} | " in page
    for method in METHODS:
        assert f"60 × 200, N = 3 | {method} | " in page


def test_methods_keep_to_the_rules_and_none_exceeds_a_bound():
    problem = street_problem(20, 300, blocks=2, count=3)
    runs = {run.method: run for run in compare("streets", problem, list(METHODS), 20)}
    best = runs["ours"]
    assert best.proven
    for run in runs.values():
        assert run.objective <= best.objective + 1e-6 <= run.bound + 2e-6
    assert runs["PuLP + CBC"].objective == runs["PuLP + HiGHS"].objective == best.objective
    assert runs["greedy"].objective <= runs["local search"].objective


def run_of(instance, method, seconds, objective, bound):
    return SolverRun(instance, method, Expense(seconds, seconds), 100.0, objective, bound, min(bound, 1000.0))


def test_requirements_are_met_only_by_what_meets_them():
    visibility = {
        "full bvh": Cost(Expense(100.0), 1, 1),
        "lazy bvh": Cost(Expense(5.0), 1, 1),
        "full embree": Cost(Expense(9.0), 1, 1),
        "lazy embree": Cost(Expense(1.0), 1, 1),
    }
    runs = [
        run_of("site", "ours", 1.0, 900.0, 900.0),
        run_of("few", "PuLP + CBC", 30.0, 900.0, 900.0),
        run_of("few", "ours", 1.0, 900.0, 900.0),
        run_of("many", "ours", 59.0, 991.0, 1000.0),
        run_of("largest", "ours", 119.0, 984.0, 1000.0),
    ]
    scans = {
        "full bvh": ScanCost(Expense(30.0), 2_000_000, 0),
        "cached bvh": ScanCost(Expense(2.0), 2_000_000, 2),
        "full embree": ScanCost(Expense(10.0), 2_000_000, 0),
        "cached embree": ScanCost(Expense(2.1), 2_000_000, 1),
    }
    findings = Findings({}, visibility, runs, scans)
    checks = requirements(findings)
    assert [check.met for check in checks] == [True, True, False, True, True, False, True, False, True]
    assert checks[2].measured == "9×"
    runs[1] = run_of("few", "PuLP + CBC", 30.0, 901.0, math.inf)  # better than what was said to be proven
    checks = requirements(replace(findings, runs=runs))
    assert not checks[3].met
    scans["cached embree"].differing = 3
    assert not requirements(findings)[-1].met
