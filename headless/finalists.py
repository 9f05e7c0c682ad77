"""Finalists of `seip place --finalists`, judged by what the shipped detector finds with them in traffic.

The panel has its finalists judged in a Python with PyTorch, by files::

    python -m headless.finalists site.blend finalists.json judgement.json --traffic run-*.npz -o out/detection
"""

from __future__ import annotations

import argparse
import importlib
from dataclasses import asdict
from pathlib import Path

from headless import runtime, survey
from headless.options import add_settings, add_weather, new_parser

import bpy

from seip_addon.core.base.errors import SeipError
from seip_addon.core.choosing.placement.judgement import MEAN, Judgement
from seip_addon.core.choosing.placement.objective import Objective, Solution
from seip_addon.core.programs.sumo_programs import NETWORK_SUFFIX, find_sumo
from seip_addon.core.sensing.lidar.catalogue import find_models, load_catalogue
from seip_addon.core.sensing.traffic.trajectories import Trajectories
from seip_addon.core.sensing.weather import weather_of
from seip_addon.core.storage.files import save_json
from seip_addon.core.workflows.finalists import (
    JudgementRequest,
    check_judged,
    find_finalists,
    judged_solution,
    read_answer,
)
from seip_addon.core.workflows.survey import Survey
from seip_addon.core.workflows.survey_settings import SurveySettings
from seip_addon.core.workflows.traffic_runs import runs_in, traffic_folder
from seip_addon.core.workflows.traffic_simulation import SIMULATION, SimulationSettings, listed_runs, simulate_runs
from seip_addon.scene.read import read_scene

SIMULATED, SECONDS = 16, 40.0
"""Number and duration of the runs that are simulated where there are none."""
TRAFFIC = "traffic"
"""Folder of these in the folder of results."""


def check_finalists(options: argparse.Namespace, objective: Objective) -> None:
    """Raise SeipError, or end the command, if finalists cannot be judged; before anything takes time."""
    check_judged(objective)
    importlib.import_module("headless.detection")  # ends the command where there is no PyTorch
    for path in options.judge_on or ():
        Trajectories.load(path)  # raises an error for a file that cannot be read
    if not _known_runs(options):
        _map_of(options.scene)


def judge(surveyed: Survey, watch: survey.Stopwatch, solution: Solution, options: argparse.Namespace) -> Solution:
    """Choose among finalists by detection, print their figures, and return the solution of the winner."""
    from headless.detection.judging import judge_finalists  # noqa: PLC0415  # needs torch

    request = watch.run("finalists", find_finalists(surveyed, solution, options.finalists))
    paths = _known_runs(options) or _simulated(surveyed, watch, options)
    judging = judge_finalists(
        surveyed.geometry, request, surveyed.models, surveyed.settings.weather, paths, options.output
    )
    judgement = watch.run("judging", judging)
    runtime.print_line(_table(judgement))
    return watch.run("evaluation", judged_solution(surveyed, solution, judgement))


def _known_runs(options: argparse.Namespace) -> list[Path]:
    return options.judge_on or survey.runs_beside(options.scene)


def _map_of(scene: Path | None) -> Path:
    """Return the map beside a scene, on which SUMO can simulate traffic.

    Raises
    ------
    SeipError
        There is no traffic, and no map or no SUMO.
    """
    scene = survey.scene_path(scene)
    found = next((path for end in (NETWORK_SUFFIX, ".xodr") if (path := scene.with_suffix(end)).is_file()), None)
    if found is None:
        raise SeipError(
            "there is no traffic to judge finalists in: name runs with --judge-on, put some into "
            f"{traffic_folder(scene)}, or put the site's streets ({scene.stem}{NETWORK_SUFFIX}) beside the scene, for "
            "SUMO to simulate some"
        )
    find_sumo()
    return found


def _simulated(surveyed: Survey, watch: survey.Stopwatch, options: argparse.Namespace) -> list[Path]:
    """Return runs that SUMO simulates in the folder of results, unless those of an earlier command are newer."""
    folder, streets = options.output / TRAFFIC, _map_of(options.scene)
    record, sources = folder / SIMULATION, (streets, survey.scene_path(options.scene))
    fresh = record.exists() and all(record.stat().st_mtime > path.stat().st_mtime for path in sources)
    if not fresh or len(listed_runs(record)) != SIMULATED:
        folder.mkdir(exist_ok=True)
        settings = SimulationSettings(duration=SECONDS)
        watch.run("traffic", simulate_runs(streets, settings, SIMULATED, surveyed.geometry, folder))
    return runs_in(folder)


def _table(judgement: Judgement) -> str:
    """Return the finalists with their average precision in the frames of the choice, the winner first."""
    names = [*judgement.weights, MEAN]
    rows = ["frames  " + "  ".join(f"{name:>12}" for name in names) + "  finalist"]
    for one in judgement.finalists:
        cells = (f"{one.precision[name].value:12.1%}" if name in one.precision else f"{'–':>12}" for name in names)
        rows.append(f"{one.frames:6}  {'  '.join(cells)}  {one.name}: {'; '.join(one.places)}")
    return "\n".join([*rows, *judgement.sentences()])


def main(argv: list[str]) -> None:
    """Judge the finalists of a file in runs of traffic, and write the judgement to a file."""
    from headless.detection.judging import judge_finalists  # noqa: PLC0415  # needs torch

    parser = new_parser("python -m headless.finalists", "Choose among placements by what a detector finds with them.")
    parser.add_argument("scene", type=Path, help="the .blend")
    parser.add_argument("finalists", type=Path, help="file with the finalists")
    parser.add_argument("judgement", type=Path, help="file to write")
    parser.add_argument("--traffic", nargs="+", type=Path, required=True, metavar="NPZ", help="runs to judge in")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder in which detections are kept")
    add_settings(parser, SurveySettings, "catalogue")
    add_weather(parser)
    options = parser.parse_args(argv)
    runtime.check_folder(options.output)
    request, weather = read_answer(JudgementRequest, options.finalists), weather_of(options.weather)
    runtime.open_scene(options.scene)
    geometry = weather.over(read_scene(bpy.context.scene).geometry)
    keys = sorted({sensor.sensor for one in request.finalists for sensor in one.sensors})
    known = find_models(load_catalogue(options.catalogue), keys)
    models = {key: weather.through(model) for key, model in known.items()}
    judging = judge_finalists(geometry, request, models, weather, options.traffic, options.output)
    save_json(options.judgement, asdict(runtime.finish_with_bar(judging)))


if __name__ == "__main__":
    runtime.run(main)
