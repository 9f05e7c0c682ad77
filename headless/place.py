"""Optimise the placement of sensors in a scene, and write it with its evidence.

In Blender, on the scene that is open::

    blender -b --python-exit-code 1 site.blend -P headless/place.py -- --sensor type1 --count 4 -o out/

or as plain Python on the bpy module::

    seip place site.blend --sensor type1 --count 4 -o out/
"""

import argparse
import importlib
import math
import sys
from dataclasses import replace
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import runtime, survey
from headless.charts.robustness import save_evaluation_charts
from headless.options import add_settings, new_parser, read_settings, real_number, whole_number

import bpy

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.limits import CHOSEN_WEIGHT, Limits
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.deployment import price_text
from seip_addon.core.choosing.placement.judgement import DEFAULT_FINALISTS
from seip_addon.core.choosing.placement.objective import Objective, Solution, check_objective
from seip_addon.core.choosing.placement.returns_summary import NOT_BY_DETECTION, share_reached
from seip_addon.core.choosing.placement.scenarios import ScenarioKind, Scenarios
from seip_addon.core.sensing.scenarios.pose_errors import PoseErrors
from seip_addon.core.workflows.placing import place, with_context
from seip_addon.core.workflows.survey import Layout
from seip_addon.core.workflows.traffic_runs import TrafficRuns, read_runs
from seip_addon.scene.sensors import sensor_positions


def add_objective(parser: argparse.ArgumentParser) -> None:
    """Add the parts of an objective to a command: criterion, constraints, scenarios and risk measure."""
    objective = parser.add_argument_group("objective")
    add_settings(objective, Objective, "count", "budget", "coverage", "criterion", "shares", "failures")
    objective.add_argument(
        "--weighted",
        nargs="?",
        const="scene",
        type=_weight,
        metavar="W",
        help="weight targets by their regions, or give all weighted regions one weight",
    )
    add_settings(objective, Objective, "min_distance", "forbidden")
    objective.add_argument(
        "--require",
        nargs="*",
        metavar="POSITION",
        help="positions with a sensor; without names those of the sensors in the scene",
    )
    scenarios = parser.add_argument_group("scenarios")
    usual = PoseErrors()
    scenarios.add_argument(
        "--pose-errors",
        nargs="*",
        type=float,
        metavar=("METRES", "DEGREES"),
        help="optimise over random errors of the sensors' poses, by standard deviations of position and of angles "
        f"({usual.position:g} {math.degrees(usual.tilt):g})",
    )
    scenarios.add_argument(
        "--traffic",
        nargs="*",
        type=Path,
        metavar="NPZ",
        help="optimise over instants of runs of traffic, and evaluate on the last third of the runs (default: those in "
        "the folder SCENE_traffic beside the scene)",
    )
    add_settings(scenarios, Objective, "risk")
    add_settings(scenarios, Scenarios, "seed")


def _weight(text: str) -> float | str:
    """Read a weight; the text ``scene`` stands for those of the scene."""
    return text if text == "scene" else real_number(CHOSEN_WEIGHT)(text)


def read_objective(options: argparse.Namespace) -> Objective:
    """Return the objective that options of `add_objective` name."""
    required = tuple(options.require or ())
    return read_settings(
        Objective, options, central_weight=options.weighted, mandatory=required, scenarios=_scenarios(options)
    )


def _scenarios(options: argparse.Namespace) -> Scenarios:
    errors: list[float] | None = options.pose_errors
    if errors is not None and options.traffic is not None:
        raise SeipError("scenarios are of pose errors or of traffic: leave out --pose-errors or --traffic")
    kind: ScenarioKind = "nominal" if options.traffic is None else "traffic"
    kind = kind if errors is None else "pose-errors"
    return replace(read_settings(Scenarios, options, pose_errors=_pose_errors(errors or [])), kind=kind)


def _pose_errors(errors: list[float]) -> PoseErrors:
    """Return pose errors of up to two numbers: metres of position and height, degrees of all angles."""
    if len(errors) > 2:
        raise SeipError(f"--pose-errors takes metres and degrees, not {len(errors)} numbers")
    usual = PoseErrors()
    position = errors[0] if errors else usual.position
    angle = math.radians(errors[1]) if len(errors) > 1 else usual.tilt
    return PoseErrors(position, position, angle, angle)


def main(argv: list[str]) -> None:
    """Place sensors in a scene and write the result to a folder."""
    options = _parser().parse_args(argv)
    objective = read_objective(options)
    finalists = None if options.finalists is None else importlib.import_module("headless.finalists")  # needs PyTorch
    if finalists is not None:
        finalists.check_finalists(options, objective)
    elif options.judge_on:
        raise SeipError("--judge-on names the traffic in which finalists are judged: add --finalists")
    if options.require == []:
        runtime.open_scene(options.scene)
        objective = replace(objective, mandatory=tuple(sensor_positions(bpy.context.scene)))
    traffic: list[TrafficRuns] = []

    def check(layout: Layout) -> None:
        check_objective(layout.site, layout.models, objective)
        if objective.scenarios.kind == "traffic":
            traffic.append(finish(read_runs(options.traffic or survey.runs_beside(options.scene), layout)))

    surveyed, watch = survey.survey(options, check, objective)
    runs = traffic[0] if traffic else None
    if runs is not None:
        runtime.LOG.info(runs.overlap)
    acceptance = runtime.accepted_by_enter()
    solution = watch.run("placement", place(surveyed, objective, runs, acceptance))
    if finalists is None:
        runtime.print_line(_describe(solution))
    solution = watch.run("fewer and more sensors", with_context(surveyed, solution, acceptance))
    if finalists is not None:
        solution = finalists.judge(surveyed, watch, solution, options)
        runtime.print_line(_describe(solution))
    with runtime.incomplete_if_interrupted(options.output):
        save_evaluation_charts(options.output, surveyed, solution)
        survey.save_solution(surveyed, watch, solution, options.output, render=not options.no_render)
    runtime.print_line(f"written to {options.output}/")


def _describe(solution: Solution) -> str:
    placement, deployment = solution.placement, solution.deployment
    lines = [
        f"{survey.describe_sensor(sensor)}: sees {sensor.alone:.1%} of the targets, {sensor.marginal:.1%} only by it"
        for sensor in deployment.sensors
    ]
    central = "" if deployment.central is None else f", central {deployment.central:.2%}"
    if deployment.returns is not None:
        lines += [deployment.returns.verdict(), deployment.returns.describe()]
    lines += [] if solution.evaluation is None else solution.evaluation.summary()
    price = price_text(deployment.price, installed=deployment.installed)
    lines.append(f"coverage {deployment.coverage:.2%}{central}, price {price}")
    lines.append(solution.certificate)
    if solution.greedy is not None and placement.objective > 0:
        of_returns = deployment.returns is not None
        reached = share_reached(solution.greedy.objective, placement.objective, of_returns=of_returns)
        lines.append(
            f"the greedy algorithm reaches {reached:.2%} of {'those returns' if of_returns else 'that objective'}"
        )
    if deployment.returns is not None and solution.judgement is None:
        lines.append(NOT_BY_DETECTION)
    return "\n".join([*lines, *solution.notes])


def _add_finalists(parser: argparse.ArgumentParser) -> None:
    """Add the options of finalists."""
    group = parser.add_argument_group("finalists")
    group.add_argument(
        "--finalists",
        nargs="?",
        const=DEFAULT_FINALISTS,
        type=whole_number(Limits(2, 100)),
        metavar="N",
        help=f"choose among this number of placements ({DEFAULT_FINALISTS}) by what the shipped detector finds with "
        "them in traffic; needs PyTorch",
    )
    group.add_argument(
        "--judge-on",
        nargs="+",
        type=Path,
        metavar="NPZ",
        help="runs of traffic: the first half for the choice, the others for its figures (default: those in the folder "
        "SCENE_traffic beside the scene, else runs that SUMO simulates)",
    )


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("seip place", "Place roadside LiDARs in a scene.")
    survey.add_options(parser)
    add_objective(parser)
    _add_finalists(parser)
    parser.add_argument("--no-render", action="store_true", help="leave out the rendered view")
    return parser


if __name__ == "__main__":
    runtime.run(main)
