"""Optimise for traffic: vehicles of sampled instants block the view. Also reports what the empty road overstates.

python -m headless.in_traffic scenes/junction.blend --sensor type1 --count 2 -o out/in_traffic
blender -b --python-exit-code 1 site.blend -P headless/in_traffic.py -- --traffic run-*.npz --sensor type1 -o out/
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from itertools import product
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import session, survey
from headless.charts.traffic import save_promise_chart, save_time_map
from headless.goal_options import add_goal_options, goal_of
from headless.traffic_runs import load_runs, parted, runs_beside

from seip_addon.core.errors import SeipError
from seip_addon.core.placement.deployment import deploy
from seip_addon.core.placement.objective import Objective, Solution, check_objective, placement_problem, with_count
from seip_addon.core.robustness.traffic_instants import check_runs, spread_instants
from seip_addon.core.robustness.traffic_presence import road_user_seconds
from seip_addon.core.robustness.traffic_study import (
    WHAT,
    JudgedInTraffic,
    TrafficStudy,
    look_at_traffic,
    traffic_study,
    traffic_warnings,
)
from seip_addon.core.traffic import Trajectories
from seip_addon.core.traffic.run_overlap import require_independent, vehicle_positions
from seip_addon.core.workflows.survey import surroundings

CHARTS = ("time_seen.png", "traffic.png")


def main(argv: list[str]) -> None:
    """Place sensors for the road in traffic and write the result to a folder."""
    options = _parser().parse_args(argv)
    goal = goal_of(options)
    for number in (options.instants, options.judged_at):
        if number < 1:
            raise SeipError(f"ask for one instant of traffic or more, not {number}")
    surveyed = survey.survey(options, lambda site, models: check_objective(site, models, goal))
    study = _studied(surveyed, goal, options)
    layout = surveyed.layout
    plan = _plan(surveyed, goal, study, options)
    session.say(_in_words(study, plan))
    with session.writing(options.output):
        name = layout.site.name
        title = f"{name}: for how long the placement sees what, {study.road_users:.0f} road users at a time"
        save_time_map(options.output / CHARTS[0], layout.geometry, layout.site, plan.deployment, study.traffic, title)
        sensors = f"{len(plan.deployment.sensors)} sensors"
        save_promise_chart(options.output / CHARTS[1], [(sensors, study)], f"{name}: empty road and traffic")
        survey.save_plan(surveyed, plan, options.output, render=not options.no_render)
    session.say(f"written to {options.output}/")


def _studied(surveyed: survey.Survey, goal: Objective, options: argparse.Namespace) -> TrafficStudy:
    layout, watch = surveyed.layout, surveyed.stopwatch
    settings = layout.settings
    to_choose_on, to_judge_in = _runs(surveyed, options)
    problem = placement_problem(layout.site, surveyed.grid.visible, layout.models, goal)
    if options.weights_from_traffic:
        seconds = watch.run("road users", road_user_seconds(layout.site.targets, to_choose_on))
        problem = replace(problem, weights=problem.weights * seconds)
    around = surroundings(layout)
    instants = spread_instants(to_choose_on, options.instants, options.seed)
    scenarios = watch.run("looks at traffic", look_at_traffic(around, problem, instants, options.see))
    judged = spread_instants(to_judge_in, options.judged_at, options.seed + 1)
    steps = traffic_study(
        around,
        problem,
        scenarios,
        judged,
        settings.limits,
    )
    return watch.run("placement in traffic", steps)


def _runs(surveyed: survey.Survey, options: argparse.Namespace) -> tuple[list[Trajectories], list[Trajectories]]:
    """Read the runs: those to choose on, and those to judge in."""
    paths = options.traffic or runs_beside(options.scene)
    if len(paths) < 2:
        raise SeipError(
            f"{len(paths)} runs of traffic are too few: name two or more with --traffic, made by headless/traffic.py "
            "with a seed each; the last third of them judges what is chosen on the others"
        )
    runs = load_runs(paths, surveyed.layout.geometry.origin)
    check_runs(runs, surveyed.layout.site.region)
    positions = [vehicle_positions(str(path), run) for path, run in zip(paths, runs, strict=True)]
    session.say(require_independent(product(*parted(positions))))
    return parted(runs)


def _plan(surveyed: survey.Survey, goal: Objective, study: TrafficStudy, options: argparse.Namespace) -> Solution:
    """Return the placement as a plan, noted what it was chosen for."""
    layout, placement = surveyed.layout, study.traffic.placement
    note = (
        f"chosen to see the {WHAT[study.layer]} in traffic, on average over {study.chosen_at} instants: objective, "
        "bound and gap are of that"
    )
    weighed = ("targets weigh as many seconds as road users are there",) if options.weights_from_traffic else ()
    noted = replace(placement, notes=(note, *weighed, *placement.notes, *traffic_warnings(study)))
    return Solution(
        with_count(goal, layout.site),
        noted,
        None,
        deploy(layout.site, layout.models, surveyed.grid.visible, placement.chosen),
    )


def _in_words(study: TrafficStudy, plan: Solution) -> str:
    sensors = [survey.sensor_in_words(sensor) for sensor in plan.deployment.sensors]
    seen = [f"chosen for {placed.name}: {_share(placed)}" for placed in (study.empty, study.traffic)]
    won = f"placing on traffic sees {study.won(study.layer).describe()} more of the {WHAT[study.layer]}"
    doubt = () if study.is_converged() else ("every other instant says something else: take more (--judged-at)",)
    return "\n".join([*sensors, *seen, won, plan.certificate, *doubt, *plan.placement.notes])


def _share(placed: JudgedInTraffic) -> str:
    return "; ".join(
        f"{seen.held.describe()} of the {WHAT[layer]} on average over time, {seen.empty:.2%} on the empty road"
        for layer, seen in placed.seen.items()
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="in_traffic",
        description="Place roadside LiDARs for the road in traffic.",
        formatter_class=survey.HelpWithDefaults,
    )
    survey.add_options(parser)
    add_goal_options(parser)
    traffic = parser.add_argument_group("traffic")
    traffic.add_argument(
        "--traffic",
        nargs="+",
        type=Path,
        default=[],
        metavar="NPZ",
        help="runs of traffic: the last third judges what is chosen on the others (those in the folder SCENE_traffic "
        "beside the scene)",
    )
    traffic.add_argument(
        "--see", choices=tuple(WHAT), default="road", help="what is to be seen: the road, or points at vehicles' height"
    )
    traffic.add_argument(
        "--weights-from-traffic", action="store_true", help="weigh targets by the time that road users are there"
    )
    traffic.add_argument("--instants", type=int, default=24, help="of traffic to choose on")
    traffic.add_argument("--judged-at", type=int, default=120, metavar="INSTANTS", help="of traffic to judge by")
    traffic.add_argument("--seed", type=int, default=0, help="of the instants; those to judge by have the next")
    parser.add_argument("--no-render", action="store_true", help="leave out the rendered view")
    return parser


if __name__ == "__main__":
    session.run(main)
