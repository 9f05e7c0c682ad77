"""Optimise a placement for pose errors, sensor failures or multiple looks.

python -m headless.robust scenes/junction.blend --sensor type1 --count 4 -o out/robust
blender -b --python-exit-code 1 site.blend -P headless/robust.py -- --sensor type1 --objective worst -o out/
"""

import argparse
import math
import sys
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import runtime, survey
from headless.charts.robust import save_frontier_chart, save_loss_chart, save_spread_chart
from headless.options import add_objective, add_settings, new_parser, read_objective, read_settings, real_number

from seip_addon.core.limits import SHARE
from seip_addon.core.placement.objective import check_objective
from seip_addon.core.robustness.pose_errors import PoseErrors
from seip_addon.core.robustness.risk import Risk
from seip_addon.core.robustness.robust_study import RobustnessSettings
from seip_addon.core.workflows.robust import RobustSolution, check_robust_objective, place_robustly

CHARTS = ("spread.png", "blame.png", "frontier.png")


def main(argv: list[str]) -> None:
    """Optimise a robust placement and write the result to a folder."""
    options = _parser().parse_args(argv)
    objective, robustness = read_objective(options), _robustness(options)
    check_robust_objective(objective, robustness.risk)
    surveyed, watch = survey.survey(options, lambda layout: check_objective(layout.site, layout.models, objective))
    robust = watch.run("robust placement", place_robustly(surveyed, objective, robustness))
    solution, study = robust.solution, robust.study
    runtime.print_line(_in_words(robust))
    with runtime.incomplete_if_interrupted(options.output):
        name = surveyed.site.name
        save_spread_chart(options.output / CHARTS[0], study, f"{name}: coverage under pose errors")
        save_loss_chart(options.output / CHARTS[1], robust.pose_study, f"{name}: what costs coverage")
        save_frontier_chart(options.output / CHARTS[2], study, f"{name}: what robustness costs and saves")
        asked = {"render": not options.no_render, "robustness": robustness.as_record()}
        survey.save_solution(surveyed, watch, solution, options.output, asked)
    runtime.print_line(f"written to {options.output}/")


def _in_words(robust: RobustSolution) -> str:
    (chosen,), solution, study = robust.study.robust, robust.solution, robust.study
    nominal = study.beside(chosen)
    lines = [survey.describe_sensor(sensor) for sensor in solution.deployment.sensors]
    return "\n".join(
        [
            *lines,
            f"planned coverage {chosen.planned:.2%}, the nominal optimum's {nominal.planned:.2%}",
            f"over {study.settings.draws} unseen draws, {chosen.evaluated_by.describe_outcome()}:",
            f"mean {chosen.mean.describe()}, the nominal optimum's {nominal.mean.describe()}",
            f"5 % quantile {chosen.low.describe()}, the nominal optimum's {nominal.low.describe()}",
            f"the 5 % quantile is higher by {study.saving(chosen).describe()}",
            solution.certificate,
            *solution.notes,
        ]
    )


def _robustness(options: argparse.Namespace) -> RobustnessSettings:
    height = options.position_error if options.height_error is None else options.height_error
    yaw = options.tilt_error if options.yaw_error is None else options.yaw_error
    errors = PoseErrors(options.position_error, height, math.radians(yaw), math.radians(options.tilt_error))
    tail = {"expected": 1.0, "cvar": options.tail, "worst": 0.0}[options.objective]
    return read_settings(RobustnessSettings, options, risk=read_settings(Risk, options, tail=tail), errors=errors)


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("robust", "Place roadside LiDARs for what may go wrong.")
    survey.add_options(parser)
    add_objective(parser)
    risk = parser.add_argument_group("what may go wrong")
    risk.add_argument(
        "--objective",
        choices=("expected", "cvar", "worst"),
        default="cvar",
        help="coverage of all scenarios on average, of the worst of them, or of the very worst",
    )
    risk.add_argument(
        "--tail", type=real_number(SHARE), default=0.25, metavar="SHARE", help="worst scenarios that cvar counts"
    )
    add_settings(risk, Risk, "seen_by", "failure")
    errors = parser.add_argument_group("pose errors, standard deviations")
    add_settings(errors, PoseErrors, "position", "height", "yaw", "tilt")
    errors.set_defaults(height_error=None, yaw_error=None, tilt_error=2.0)
    add_settings(errors, RobustnessSettings, "scenarios", "draws", "seed")
    parser.add_argument("--no-render", action="store_true", help="leave out the rendered view")
    return parser


if __name__ == "__main__":
    runtime.run(main)
