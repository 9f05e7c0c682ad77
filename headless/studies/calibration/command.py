"""Compare LiDAR models with measured sweeps, and fit the law of detection to them.

seip study calibration reference.json -o out/calibration --sensor roadside_80=vls128
blender -b --python-exit-code 1 -P headless/study.py -- calibration reference.json -o out/calibration
"""

from __future__ import annotations

import argparse
from pathlib import Path

from headless import runtime
from headless.options import add_settings, new_parser
from headless.studies.calibration.charts import (
    save_fate_chart,
    save_ground_chart,
    save_noise_chart,
    save_vertical_chart,
)
from headless.studies.calibration.comparison import compare, pair
from headless.studies.calibration.reference import load_reference
from headless.studies.calibration.report import describe, save_calibration

from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.workflows.survey_settings import SurveySettings

CHARTS = {
    "ground.png": save_ground_chart,
    "vertical.png": save_vertical_chart,
    "noise.png": save_noise_chart,
    "fate.png": save_fate_chart,
}


def main(argv: list[str]) -> None:
    """Compare models with measured sensors, print the table, and write it with its charts."""
    options = _parser().parse_args(argv)
    measured = load_reference(options.reference)
    models = pair(measured, load_catalogue(options.catalogue), options.sensor)
    runtime.check_folder(options.output)
    comparisons = [compare(name, measured[name], model) for name, model in models.items()]
    for one in comparisons:
        for line in describe(one):
            runtime.print_line(line)
    alone = [name for name in measured if name not in models]
    if alone:
        runtime.warn([f"{', '.join(alone)}: not compared with any model; name one with --sensor MEASURED=KEY"])
    with runtime.incomplete_if_interrupted(options.output):
        save_calibration(options.output / "calibration.json", comparisons)
        for file, save in CHARTS.items():
            save(options.output / file, comparisons)
    runtime.print_line(f"written to {options.output}/")


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("study calibration", "Compare LiDAR models with measured sweeps.")
    parser.add_argument("reference", type=Path, help="measurements as JSON (docs/formats.md)")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the results")
    parser.add_argument(
        "--sensor",
        nargs="+",
        default=[],
        metavar="MEASURED=KEY",
        help="model (catalogue key) of a measured sensor whose name is not itself a key",
    )
    add_settings(parser, SurveySettings, "catalogue")
    return parser
