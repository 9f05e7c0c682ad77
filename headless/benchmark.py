"""Benchmark of visibility, placement and scans against alternatives: charts, a page and a JSON file.

python -m headless.benchmark scenes/junction.blend -o docs
"""

import argparse
from pathlib import Path

from headless import runtime
from headless.lab.benchmark.charts import save_charts
from headless.lab.benchmark.measurements import BenchmarkScope, measure
from headless.lab.benchmark.report import bars, save_json, save_page

import bpy

from seip_addon.scene.read import read_scene


def main(argv: list[str], scope: BenchmarkScope | None = None) -> None:
    """Measure, and write the results into a folder; tests give a small ``scope``."""
    parser = argparse.ArgumentParser(
        prog="benchmark", description=__doc__.splitlines()[0], formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument("scene", type=Path, help="the .blend")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for benchmark.md and benchmark/")
    parser.add_argument("--places", type=int, default=12, help="how many places are sampled; a full scan takes seconds")
    parser.add_argument("--time-limit", type=float, default=60.0, help="for each answer of a solver, in seconds")
    options = parser.parse_args(argv)
    runtime.check_folder(options.output / "benchmark")
    runtime.open_scene(options.scene)
    findings, names = measure(
        read_scene(bpy.context.scene).geometry, options.places, options.time_limit, scope or BenchmarkScope()
    )
    checks = bars(findings.costs, findings.runs, names, findings.scans)
    for bar in checks:
        runtime.print_line(f"{bar.what}: asked {bar.asked}, measured {bar.measured}{'' if bar.met else ' – NOT MET'}")
    with runtime.incomplete_if_interrupted(options.output):
        save_charts(options.output / "benchmark", findings)
        save_json(options.output / "benchmark" / "benchmark.json", findings, checks)
        save_page(options.output / "benchmark.md", findings, checks, "benchmark")
    runtime.print_line(f"results: {options.output / 'benchmark.md'}")


if __name__ == "__main__":
    runtime.run(main)
