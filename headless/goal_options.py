"""Command-line options of a placement's objective and constraints."""

from __future__ import annotations

import argparse

from seip_addon.core.placement.objective import DEFAULT_COUNT, Objective


def add_goal_options(parser: argparse.ArgumentParser) -> argparse._ArgumentGroup:
    """Add what a goal is made of to a command, and return the group."""
    goal = parser.add_argument_group("goal")
    goal.add_argument(
        "--count", type=int, metavar="N", help=f"largest number of sensors ({DEFAULT_COUNT} if no goal is given)"
    )
    goal.add_argument("--budget", type=float, metavar="USD", help="largest total price")
    goal.add_argument("--weighted", action="store_true", help="count targets by the weights of their regions")
    goal.add_argument("--central-weight", type=float, metavar="W", help="one weight for all weighted regions")
    goal.add_argument("--min-distance", type=float, default=0.0, metavar="M", help="between two sensors")
    goal.add_argument("--forbid", nargs="+", default=[], metavar="POSITION", help="positions without sensor")
    goal.add_argument("--require", nargs="+", default=[], metavar="POSITION", help="positions with a sensor")
    return goal


def goal_of(options: argparse.Namespace, coverage: float | None = None) -> Objective:
    """Return the goal that options of `add_goal_options` name, with a coverage to reach."""
    return Objective(
        count=options.count,
        budget=options.budget,
        coverage=coverage,
        central_weight="scene" if options.weighted and options.central_weight is None else options.central_weight,
        min_distance=options.min_distance,
        forbidden=tuple(options.forbid),
        mandatory=tuple(options.require),
    )
