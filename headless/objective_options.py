"""Options of an objective: criterion, constraints, scenarios and risk measure."""

import argparse
import math
from dataclasses import replace
from pathlib import Path

from headless.options import add_settings, read_settings

from seip_addon.core.choosing.placement.objective import Objective
from seip_addon.core.choosing.placement.scenarios import PoseErrors, ScenarioKind, Scenarios
from seip_addon.core.errors import SeipError


def add_objective(parser: argparse.ArgumentParser) -> None:
    """Add the parts of an objective to a command: criterion, constraints, scenarios and risk measure."""
    objective = parser.add_argument_group("objective")
    add_settings(objective, Objective, "count", "budget", "coverage", "criterion", "shares", "failures")
    objective.add_argument("--weighted", action="store_true", help="weight targets by their regions")
    add_settings(objective, Objective, "central_weight", "min_distance", "forbidden", "mandatory")
    scenarios = parser.add_argument_group("scenarios")
    scenarios.add_argument(
        "--pose-errors", action="store_true", help="optimise over random errors of the sensors' poses"
    )
    add_settings(scenarios, PoseErrors, "position", "height", "yaw", "tilt")
    scenarios.set_defaults(position_error=None, height_error=None, yaw_error=None, tilt_error=None)
    scenarios.add_argument(
        "--traffic",
        nargs="*",
        type=Path,
        metavar="NPZ",
        help="optimise over instants of runs of traffic, and evaluate on the last third of the runs (default: those in "
        "the folder SCENE_traffic beside the scene)",
    )
    add_settings(scenarios, Objective, "risk")
    add_settings(scenarios, Scenarios, "count", "held_out", "seed")


def read_objective(options: argparse.Namespace) -> Objective:
    """Return the objective that options of `add_objective` name."""
    weight = "scene" if options.weighted and options.central_weight is None else options.central_weight
    return read_settings(Objective, options, central_weight=weight, scenarios=_scenarios(options))


def _scenarios(options: argparse.Namespace) -> Scenarios:
    errors = [options.position_error, options.height_error, options.yaw_error, options.tilt_error]
    errs = options.pose_errors or any(error is not None for error in errors)
    if errs and options.traffic is not None:
        raise SeipError("scenarios are of pose errors or of traffic: leave out --pose-errors or --traffic")
    kind: ScenarioKind = "pose-errors" if errs else "nominal" if options.traffic is None else "traffic"
    return replace(read_settings(Scenarios, options, pose_errors=_pose_errors(*errors)), kind=kind)


def _pose_errors(position: float | None, height: float | None, yaw: float | None, tilt: float | None) -> PoseErrors:
    """Return pose errors in metres and degrees: height follows position, and yaw tilt, where they are not given."""
    usual = PoseErrors()
    position = usual.position if position is None else position
    tilted = usual.tilt if tilt is None else math.radians(tilt)
    return PoseErrors(
        position, position if height is None else height, tilted if yaw is None else math.radians(yaw), tilted
    )
