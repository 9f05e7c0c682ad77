"""Benchmark of visibility, placement and scans against alternatives: charts, a page and a JSON file.

seip study benchmark scenes/junction.blend -o docs
seip study benchmark scenes/junction.blend -o docs --only placement
seip study benchmark scenes/junction.blend -o docs --only sensor-models --site town.blend
"""

import argparse
from dataclasses import replace
from pathlib import Path

from headless import runtime
from headless.studies.benchmark.charts import save_charts
from headless.studies.benchmark.measurements import BenchmarkScope, compare_sensor_models, measure, with_placement
from headless.studies.benchmark.report import bars, load_json, save_json, save_page
from headless.studies.benchmark.sensor_report import save_sensor_model_chart

import bpy

from seip_addon.core.progress import finish
from seip_addon.scene.read import read_scene


def main(argv: list[str], scope: BenchmarkScope | None = None) -> None:
    """Run the measurements and write the results into a folder; tests pass a small ``scope``."""
    parser = argparse.ArgumentParser(
        prog="benchmark", description=__doc__.splitlines()[0], formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument("scene", type=Path, help="scene (.blend)")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for benchmark.md and benchmark/")
    parser.add_argument(
        "--places", type=int, default=12, help="number of sampled positions; a full scan of each takes seconds"
    )
    parser.add_argument(
        "--effort",
        type=float,
        default=60.0,
        help="limit of each solve: units of counted work, and seconds for the methods of others",
    )
    parser.add_argument(
        "--only", choices=("placement", "sensor-models"), help="measure only this part; keep the rest of the page"
    )
    models = parser.add_argument_group("models of the sensor")
    models.add_argument(
        "--site", action="append", type=Path, default=[], metavar="BLEND", help="another scene to measure; repeat it"
    )
    models.add_argument("--seed", type=int, default=0, help="seed for placements, scans and the detector's training")
    models.add_argument("--steps", type=int, default=1800, help="training steps of the detector (only with PyTorch)")
    models.add_argument("--work", type=Path, default=Path("out/benchmark"), help="folder of the detector")
    options = parser.parse_args(argv)
    scope = scope or BenchmarkScope()
    pictures = options.output / "benchmark"
    runtime.check_folder(pictures)
    runtime.check_folder(options.work)
    figures = pictures / "benchmark.json"
    kept = load_json(figures) if options.only or figures.exists() else None
    if options.only == "sensor-models" and kept is not None:
        findings, checks = kept
    else:
        runtime.open_scene(options.scene)
        geometry = read_scene(bpy.context.scene).geometry
        if options.only and kept is not None:
            findings, names = with_placement(kept[0], geometry, options.effort, scope)
        else:
            findings, names = measure(geometry, options.places, options.effort, scope)
        checks = bars(findings.costs, findings.runs, names, findings.scans)
    for bar in checks:
        verdict = "" if bar.met else " – NOT MET"
        runtime.print_line(f"{bar.what}: required {bar.asked}, measured {bar.measured}{verdict}")
    if options.only != "placement":
        steps = compare_sensor_models(
            [options.scene, *options.site],
            options.effort,
            scope,
            seed=options.seed,
            steps=options.steps,
            work=options.work,
        )
        with runtime.progress_bar() as report:
            models_compared = finish(steps, report).over(kept[0].sensor_models if kept else None)
        findings = replace(findings, sensor_models=models_compared)
    with runtime.incomplete_if_interrupted(options.output):
        if options.only != "sensor-models":
            save_charts(pictures, findings)
        if findings.sensor_models is not None:
            save_sensor_model_chart(pictures, findings.sensor_models)
        save_json(figures, findings, checks)
        save_page(options.output / "benchmark.md", findings, checks, "benchmark")
    runtime.print_line(f"results: {options.output / 'benchmark.md'}")
