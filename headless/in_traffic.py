"""Optimise for traffic: vehicles of sampled instants block the view. Also reports what the empty road overstates.

python -m headless.in_traffic scenes/junction.blend --sensor type1 --count 2 -o out/in_traffic
blender -b --python-exit-code 1 site.blend -P headless/in_traffic.py -- --traffic run-*.npz --sensor type1 -o out/
"""

import argparse
import sys
from dataclasses import asdict
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import runtime, survey
from headless.charts.traffic import save_time_map, save_traffic_chart
from headless.options import add_objective, add_settings, new_parser, read_objective, read_settings

from seip_addon.core.counts import counted
from seip_addon.core.placement.objective import Solution, check_objective
from seip_addon.core.progress import finish
from seip_addon.core.robustness.traffic_study import LAYER_NAMES, TrafficEvaluation, TrafficStudy
from seip_addon.core.workflows.survey import Layout
from seip_addon.core.workflows.traffic import TrafficRuns, TrafficSettings, place_in_traffic, read_runs

CHARTS = ("time_seen.png", "traffic.png")


def main(argv: list[str]) -> None:
    """Optimise a placement for traffic and write the result to a folder."""
    options = _parser().parse_args(argv)
    objective, settings = read_objective(options), read_settings(TrafficSettings, options)
    traffic: list[TrafficRuns] = []

    def check(layout: Layout) -> None:
        check_objective(layout.site, layout.models, objective)
        traffic.append(finish(read_runs(options.traffic or survey.runs_beside(options.scene), layout)))

    surveyed, watch = survey.survey(options, check)
    (runs,) = traffic
    runtime.LOG.info(runs.overlap)
    placed = watch.run("placement in traffic", place_in_traffic(surveyed, objective, runs, settings))
    solution, study = placed.solution, placed.study
    runtime.print_line(_in_words(study, solution))
    with runtime.incomplete_if_interrupted(options.output):
        name = surveyed.site.name
        title = f"{name}: for how long the placement sees what, {study.road_users:.0f} road users at a time"
        save_time_map(
            options.output / CHARTS[0], surveyed.geometry, surveyed.site, solution.deployment, study.traffic, title
        )
        sensors = counted(len(solution.deployment.sensors), "sensor")
        save_traffic_chart(options.output / CHARTS[1], [(sensors, study)], f"{name}: empty road and traffic")
        asked = {"render": not options.no_render, "traffic": asdict(settings)}
        survey.save_solution(surveyed, watch, solution, options.output, asked)
    runtime.print_line(f"written to {options.output}/")


def _in_words(study: TrafficStudy, solution: Solution) -> str:
    sensors = [survey.describe_sensor(sensor) for sensor in solution.deployment.sensors]
    seen = [f"chosen for {placed.name}: {_share(placed)}" for placed in (study.empty, study.traffic)]
    return "\n".join([*sensors, *seen, solution.certificate, *solution.notes])


def _share(placed: TrafficEvaluation) -> str:
    return "; ".join(
        f"{seen.mean.describe()} of the {LAYER_NAMES[layer]} on average over time, {seen.empty:.2%} on the empty road"
        for layer, seen in placed.seen.items()
    )


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("in_traffic", "Place roadside LiDARs for the road in traffic.")
    survey.add_options(parser)
    add_objective(parser)
    traffic = parser.add_argument_group("traffic")
    traffic.add_argument(
        "--traffic",
        nargs="+",
        type=Path,
        default=[],
        metavar="NPZ",
        help="runs of traffic: what is chosen on the others is evaluated on the last third (those in the folder "
        "SCENE_traffic beside the scene)",
    )
    names = ("layer", "weights_from_traffic", "instants", "evaluation_instants", "seed")
    add_settings(traffic, TrafficSettings, *names)
    parser.add_argument("--no-render", action="store_true", help="leave out the rendered view")
    return parser


if __name__ == "__main__":
    runtime.run(main)
