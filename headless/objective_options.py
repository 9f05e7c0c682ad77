"""Options of an objective: criterion, constraints, scenarios and risk measure."""

import argparse
import math
from dataclasses import replace
from pathlib import Path

from headless.options import add_settings, read_settings, real_number

from seip_addon.core.choosing.placement.objective import Objective
from seip_addon.core.choosing.placement.scenarios import PoseErrors, ScenarioKind, Scenarios
from seip_addon.core.errors import SeipError
from seip_addon.core.limits import CHOSEN_WEIGHT


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
