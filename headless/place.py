"""Optimise the placement of sensors in a scene, and write it with its evidence.

In Blender, on the scene that is open::

    blender -b --python-exit-code 1 site.blend -P headless/place.py -- --sensor type1 --count 4 -o out/

or as plain Python on the bpy module::

    python -m headless.place site.blend --sensor type1 --count 4 -o out/
"""

import argparse
import sys
from functools import partial
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import runtime, survey
from headless.convergence import coarsest_settings
from headless.options import add_objective, add_settings, new_parser, read_objective, real_number

from seip_addon.core.limits import SHARE
from seip_addon.core.placement.deployment import price_text
from seip_addon.core.placement.objective import Objective, Solution, check_objective
from seip_addon.core.placement.returns_summary import share_reached
from seip_addon.core.workflows.survey import place


def main(argv: list[str]) -> None:
    """Place sensors in a scene and write the result to a folder."""
    options = _parser().parse_args(argv)
    objective = read_objective(options)
    tolerance = options.tolerance
    refine = None if tolerance is None else partial(coarsest_settings, objective=objective, tolerance=tolerance)
    surveyed, watch = survey.survey(
        options, lambda layout: check_objective(layout.site, layout.models, objective), refine
    )
    solution = watch.run("placement", place(surveyed, objective, pose_errors=options.pose_errors))
    runtime.print_line(_in_words(solution))
    with runtime.incomplete_if_interrupted(options.output):
        asked = {"render": not options.no_render, "pose_errors": options.pose_errors}
        survey.save_solution(surveyed, watch, solution, options.output, asked)
    runtime.print_line(f"written to {options.output}/")


def _in_words(solution: Solution) -> str:
    placement, deployment = solution.placement, solution.deployment
    lines = [
        f"{survey.describe_sensor(sensor)}: sees {sensor.alone:.1%} of the targets, {sensor.marginal:.1%} alone"
        for sensor in deployment.sensors
    ]
    central = "" if deployment.central is None else f", central {deployment.central:.2%}"
    lines += [] if deployment.returns is None else [deployment.returns.describe()]
    price = price_text(deployment.price, installed=deployment.installed)
    lines.append(f"coverage {deployment.coverage:.2%}{central}, price {price}")
    lines.append(solution.certificate)
    if solution.greedy is not None and placement.objective > 0:
        of_returns = deployment.returns is not None
        reached = share_reached(solution.greedy.objective, placement.objective, of_returns=of_returns)
        lines.append(
            f"the greedy algorithm reaches {reached:.2%} of {'those returns' if of_returns else 'that objective'}"
        )
    return "\n".join([*lines, *solution.notes])


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("place", "Place roadside LiDARs in a scene.")
    survey.add_options(parser, in_full=True)
    add_settings(add_objective(parser), Objective, "coverage", "criterion", "shares")
    parser.add_argument(
        "--tolerance",
        type=real_number(SHARE),
        metavar="SHARE",
        help="pick the coarsest --grid and --spacing whose placement covers as much but for this share",
    )
    parser.add_argument(
        "--pose-errors",
        action="store_true",
        help="try the placement with sensors that do not hang quite as planned, which casts rays",
    )
    parser.add_argument("--no-render", action="store_true", help="leave out the rendered view")
    return parser


if __name__ == "__main__":
    runtime.run(main)
