"""Redo the study's coverage figures on any scene: types × heights × numbers, vanilla against weighted.

python -m headless.study scenes/junction.blend -o out/study
blender -b --python-exit-code 1 site.blend -P headless/study.py -- -o out/study
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import session

import bpy

from seip_addon.core.candidates import CandidateSettings
from seip_addon.core.coverage_study import NUMBERS, coverage_study, judge
from seip_addon.core.lidar import find_models, load_catalogue
from seip_addon.core.pictures.plan_view import save_plan_view
from seip_addon.core.pictures.study_charts import save_claims, save_height_chart, save_study_table, save_weight_chart
from seip_addon.core.progress import finish
from seip_addon.core.ring_resolution import resolution_warnings
from seip_addon.core.site import make_site
from seip_addon.core.visibility import VisibilitySettings
from seip_addon.core.visibility_store import stored_visibility
from seip_addon.scene.read import read_scene

WEIGHT_SHOWN = 4.0
"""Central weight of the plans that stand beside the vanilla ones."""


def main(argv: list[str]) -> None:
    """Run the study on one scene and write charts, tables and plans to a folder."""
    options = _parser().parse_args(argv)
    models = find_models(load_catalogue(options.catalogue), options.sensor)
    layout = CandidateSettings(sensors=tuple(options.sensor), heights=tuple(options.heights), spacing=options.spacing)
    visibility = VisibilitySettings(delta=options.delta)
    session.check_folder(options.output)
    session.open_scene(options.scene)
    reading = read_scene(bpy.context.scene)
    site = make_site(reading.geometry, layout, options.grid)
    for sentence in reading.warnings + resolution_warnings(site, models, visibility):
        session.say(f"warning: {sentence}")

    folder: Path = options.output
    with session.progress_bar() as report:
        grid = finish(stored_visibility(folder / "visibility.npz", site, models, visibility), report)
    visible = grid.visible
    with session.progress_bar() as report:
        study = finish(
            coverage_study(site, models, visible, solver=options.solver, time_limit=options.time_limit), report
        )
    claims = judge(study)

    save_study_table(folder / "coverage.csv", study, site.candidates.height.tolist())
    save_height_chart(folder / "heights.png", study, site.name)
    weighted = site.targets.central.any()
    if weighted:
        save_weight_chart(folder / "weights.png", study, site.name)
    for sensor in study.sensors:
        for weight in (1.0, WEIGHT_SHOWN) if weighted else (1.0,):
            case = study.case(sensor, NUMBERS[-1], weight=weight)
            name = f"plan_{sensor}_{'vanilla' if weight == 1.0 else 'weighted'}.png"
            save_plan_view(folder / name, reading.geometry, site, case.deployment)
    save_claims(folder / "claims.md", claims, site.name)
    for claim in claims:
        session.say(f"claim {claim.number}: {claim.verdict}: {claim.text} ({claim.evidence})")
    session.say(f"written to {folder}/")


def _parser() -> argparse.ArgumentParser:
    layout, sight = CandidateSettings(), VisibilitySettings()
    parser = argparse.ArgumentParser(
        prog="study",
        description="Redo the study's coverage figures on a scene.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    parser.add_argument("scene", nargs="?", type=Path, help="the .blend; in Blender the open scene")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the results")
    parser.add_argument(
        "--sensor", nargs="+", default=list(layout.sensors), metavar="KEY", help="types, the simplest first"
    )
    parser.add_argument("--catalogue", nargs="+", type=Path, default=[], metavar="TOML", help="catalogues of your own")
    parser.add_argument("--heights", nargs="+", type=float, default=list(layout.heights), metavar="M")
    parser.add_argument("--grid", type=float, default=1.0, help="spacing of the targets, metres")
    parser.add_argument(
        "--delta", type=float, default=sight.delta, help="a return closer than this sees a target, metres"
    )
    parser.add_argument("--spacing", type=float, default=layout.spacing, help="between posts on the pavement, metres")
    parser.add_argument("--solver", default="highs", help="highs, cbc or gurobi")
    parser.add_argument("--time-limit", type=float, default=60.0, metavar="S", help="for each cell, in seconds")
    return parser


if __name__ == "__main__":
    session.run(main)
