"""Place sensors in a scene: visibility of every candidate, the best choice, and the evidence for it.

In Blender, on the scene that is open::

    blender -b --python-exit-code 1 site.blend -P headless/place.py -- --sensor type1 --count 4 -o out/

or as plain Python on the bpy module::

    python -m headless.place site.blend --sensor type1 --count 4 -o out/
"""

from __future__ import annotations

import argparse
import sys
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import session, survey
from headless.goal_options import add_goal_options, goal_of

import bpy

from seip_addon.core.convergence import coarsest_settings
from seip_addon.core.goal import Plan, check_goal
from seip_addon.core.orientation import tilt_in_words
from seip_addon.core.results.placement_record import versions
from seip_addon.core.survey import Circumstances, place, record_of
from seip_addon.scene.result_folder import write_result_folder


def main(argv: list[str]) -> None:
    """Place sensors in a scene and write the result to a folder."""
    options = _parser().parse_args(argv)
    goal = goal_of(options, options.coverage)
    refine = None if options.tolerance is None else partial(coarsest_settings, goal=goal, tolerance=options.tolerance)
    surveyed = survey.survey(options, lambda site, models: check_goal(site, models, goal), refine)
    layout, watch = surveyed.layout, surveyed.stopwatch
    plan = watch.run("placement", place(layout, surveyed.grid, goal))
    circumstances = Circumstances(datetime.now(UTC), watch.seconds, versions(blender=bpy.app.version_string))
    record = record_of(layout, surveyed.grid, plan, circumstances, render=not options.no_render)
    session.say(_in_words(plan))
    with session.writing(options.output):
        write_result_folder(
            options.output,
            bpy.context.scene,
            layout.geometry,
            layout.site,
            plan,
            record,
            visible=surveyed.grid.visible,
            models=layout.models,
            render=not options.no_render,
        )
    session.say(f"written to {options.output}/")


def _in_words(plan: Plan) -> str:
    placement, deployment = plan.placement, plan.deployment
    lines = [
        f"{sensor.label}  {sensor.model.key} at {sensor.height:g} m{tilt_in_words(sensor.tilt)}, "
        f"{sensor.position_name}: sees {sensor.alone:.1%} of the targets, {sensor.marginal:.1%} alone"
        for sensor in deployment.sensors
    ]
    central = "" if deployment.central is None else f", central {deployment.central:.2%}"
    lines.append(f"coverage {deployment.coverage:.2%}{central}, price ${deployment.price:,.0f}")
    lines.append(plan.certificate)
    if plan.greedy is not None and placement.objective > 0:
        lines.append(
            f"the greedy algorithm reaches {plan.greedy.objective / placement.objective:.2%} of that objective"
        )
    return "\n".join([*lines, *placement.notes])


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="place",
        description="Place roadside LiDARs in a scene.",
        formatter_class=survey.HelpWithDefaults,
    )
    survey.add_options(parser)
    goal = add_goal_options(parser)
    goal.add_argument("--coverage", type=float, metavar="SHARE", help="reach this share (0 to 1) at the least price")
    parser.add_argument(
        "--tolerance",
        type=float,
        metavar="SHARE",
        help="pick --grid and --spacing: the coarsest whose placement covers as much but for this share",
    )
    parser.add_argument("--no-render", action="store_true", help="leave out the rendered view")
    return parser


if __name__ == "__main__":
    session.run(main)
