"""Place sensors for poses that are not quite as planned, for sensors that fail, for looks from several sides.

python -m headless.robust scenes/junction.blend --sensor type1 --count 4 -o out/robust
blender -b --python-exit-code 1 site.blend -P headless/robust.py -- --sensor type1 --objective worst -o out/
"""

from __future__ import annotations

import argparse
import math
import sys
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import session, survey
from headless.goal_options import add_goal_options, goal_of

import bpy

from seip_addon.core.deployment import deploy
from seip_addon.core.goal import Goal, Plan, check_goal, placement_problem
from seip_addon.core.orientation import tilt_in_words
from seip_addon.core.pictures.stability_robust_charts import save_blame_chart, save_frontier_chart, save_spread_chart
from seip_addon.core.results.placement_record import versions
from seip_addon.core.stability.pose_errors import PoseErrors, require_draws
from seip_addon.core.stability.pose_study import PoseStudy, StudySettings, pose_study, pose_warnings
from seip_addon.core.stability.risk import Risk
from seip_addon.core.stability.robust_study import Contender, RobustSettings, RobustStudy, robust_study
from seip_addon.core.survey import Circumstances, record_of, surroundings
from seip_addon.scene.result_folder import write_result_folder

CHARTS = ("spread.png", "blame.png", "frontier.png")


def main(argv: list[str]) -> None:
    """Place sensors for what may go wrong and write the result to a folder."""
    options = _parser().parse_args(argv)
    goal, errors, risk = goal_of(options), _errors(options), _risk(options)
    for number in (options.scenarios, options.draws):
        require_draws(number)
    surveyed = survey.survey(options, lambda site, models: check_goal(site, models, goal))
    study = _placed(surveyed, goal, risk, errors, options)
    (chosen,) = study.robust
    plan, judged = _plan(surveyed, goal, chosen, errors, options)
    record = record_of(
        surveyed.layout,
        surveyed.grid,
        plan,
        Circumstances(datetime.now(UTC), surveyed.stopwatch.seconds, versions(blender=bpy.app.version_string)),
        render=not options.no_render,
    )
    session.say(_in_words(study, chosen, plan))
    with session.writing(options.output):
        layout = surveyed.layout
        save_spread_chart(options.output / CHARTS[0], study, f"{layout.site.name}: coverage under pose errors")
        save_blame_chart(options.output / CHARTS[1], judged, f"{layout.site.name}: what costs coverage")
        save_frontier_chart(options.output / CHARTS[2], study, f"{layout.site.name}: what robustness costs and saves")
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


def _placed(
    surveyed: survey.Survey, goal: Goal, risk: Risk, errors: PoseErrors, options: argparse.Namespace
) -> RobustStudy:
    layout = surveyed.layout
    problem = placement_problem(layout.site, surveyed.grid.visible, layout.models, goal)
    settings = RobustSettings(
        errors=errors,
        scenarios=options.scenarios,
        unseen=options.draws,
        seed=options.seed,
        solver=layout.settings.solver,
        time_limit=layout.settings.time_limit,
    )
    steps = robust_study(surroundings(layout), problem, settings, [risk])
    return surveyed.stopwatch.run("robust placement", steps)


def _plan(
    surveyed: survey.Survey, goal: Goal, chosen: Contender, errors: PoseErrors, options: argparse.Namespace
) -> tuple[Plan, PoseStudy]:
    """Return the placement as a plan, noted what it was chosen for, and what pose errors do to it."""
    layout = surveyed.layout
    deployment = deploy(layout.site, layout.models, surveyed.grid.visible, chosen.placement.chosen)
    settings = StudySettings(errors, options.draws, min(100, options.draws), options.seed + 1)
    steps = pose_study(surroundings(layout), deployment, settings)
    judged = surveyed.stopwatch.run("pose errors", steps)
    note = f"chosen for {chosen.name} over {options.scenarios} scenarios: objective, bound and gap are of that"
    placement = replace(chosen.placement, notes=(note, *chosen.placement.notes, *pose_warnings(judged)))
    return Plan(goal, placement, None, deployment), judged


def _in_words(study: RobustStudy, chosen: Contender, plan: Plan) -> str:
    nominal, outcome = study.beside(chosen), chosen.judged_by.outcome_in_words()
    lines = [
        f"{sensor.label}  {sensor.model.key} at {sensor.height:g} m{tilt_in_words(sensor.tilt)}, {sensor.position_name}"
        for sensor in plan.deployment.sensors
    ]
    return "\n".join(
        [
            *lines,
            f"planned coverage {chosen.planned:.2%}, {study.price(chosen):.2%} less than the nominal optimum's",
            f"{outcome}, over {study.settings.unseen} unseen draws:",
            f"5 % quantile {chosen.low.in_words()}, the nominal optimum's {nominal.low.in_words()}",
            f"which is {study.saving(chosen).in_words()} more, draw for draw",
            f"mean {chosen.mean.in_words()}, the nominal optimum's {nominal.mean.in_words()}",
            plan.certificate,
            *plan.placement.notes,
        ]
    )


def _errors(options: argparse.Namespace) -> PoseErrors:
    height = options.position_error if options.height_error is None else options.height_error
    yaw = options.tilt_error if options.yaw_error is None else options.yaw_error
    return PoseErrors(options.position_error, height, math.radians(yaw), math.radians(options.tilt_error))


def _risk(options: argparse.Namespace) -> Risk:
    tail = {"expected": 1.0, "cvar": options.tail, "worst": 0.0}[options.objective]
    return Risk(tail, options.seen_by, options.failure)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="robust",
        description="Place roadside LiDARs for what may go wrong.",
        formatter_class=survey.HelpWithDefaults,
    )
    survey.add_options(parser)
    add_goal_options(parser)
    risk = parser.add_argument_group("what may go wrong")
    risk.add_argument(
        "--objective",
        choices=("expected", "cvar", "worst"),
        default="cvar",
        help="coverage of all scenarios on average, of the worst of them, or of the very worst",
    )
    risk.add_argument("--tail", type=float, default=0.25, metavar="SHARE", help="worst scenarios that cvar counts")
    risk.add_argument("--seen-by", type=int, default=1, metavar="K", help="sensors that must see a target")
    risk.add_argument(
        "--failure", choices=("none", "worst", "mean"), default="none", help="of one sensor: the worst, or any"
    )
    errors = parser.add_argument_group("pose errors, standard deviations")
    errors.add_argument("--position-error", type=float, default=0.3, metavar="M", help="of x and y")
    errors.add_argument("--height-error", type=float, metavar="M", help="as of the position if not given")
    errors.add_argument("--yaw-error", type=float, metavar="DEG", help="as of the tilt if not given")
    errors.add_argument("--tilt-error", type=float, default=2.0, metavar="DEG", help="of pitch and roll")
    errors.add_argument("--scenarios", type=int, default=20, help="draws to choose on")
    errors.add_argument("--draws", type=int, default=500, help="unseen draws to judge by")
    errors.add_argument("--seed", type=int, default=0, help="of the scenarios; unseen draws have the next")
    parser.add_argument("--no-render", action="store_true", help="leave out the rendered view")
    return parser


if __name__ == "__main__":
    session.run(main)
