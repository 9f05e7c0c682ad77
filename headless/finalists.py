"""Finalists of `seip place --finalists`, judged by what the shipped detector finds with them in traffic."""

from __future__ import annotations

import argparse
import importlib
from pathlib import Path

from headless import runtime, survey
from headless.options import whole_number

from seip_addon.core.choosing.placement.judgement import MEAN, Judgement
from seip_addon.core.choosing.placement.objective import Objective, Solution
from seip_addon.core.errors import SeipError
from seip_addon.core.limits import Limits
from seip_addon.core.sumo_programs import NETWORK_SUFFIX, find_sumo
from seip_addon.core.workflows.finalists import DEFAULT_FINALISTS, find_finalists, judged_solution, require_judged
from seip_addon.core.workflows.judging import judgement_request
from seip_addon.core.workflows.survey import Survey
from seip_addon.core.workflows.traffic_runs import runs_in, traffic_folder
from seip_addon.core.workflows.traffic_simulation import SIMULATION, SimulationSettings, listed_runs, simulate_runs

SIMULATED, SECONDS = 16, 40.0
"""Number and duration of the runs that are simulated where there are none."""
TRAFFIC = "traffic"
"""Folder of these in the folder of results."""


def add_finalists(parser: argparse.ArgumentParser) -> None:
    """Add the options of finalists to a command."""
    group = parser.add_argument_group("finalists")
    group.add_argument(
        "--finalists",
        nargs="?",
        const=DEFAULT_FINALISTS,
        type=whole_number(Limits(2, 100)),
        metavar="N",
        help=f"choose among so many placements ({DEFAULT_FINALISTS}) by what the shipped detector finds with them in "
        "traffic; needs PyTorch",
    )
    group.add_argument(
        "--judge-on",
        nargs="+",
        type=Path,
        metavar="NPZ",
        help="runs of traffic: the first half for the choice, the others for its figures (default: those in the folder "
        "SCENE_traffic beside the scene, else runs that SUMO simulates)",
    )


def check_finalists(options: argparse.Namespace, objective: Objective) -> None:
    """Raise SeipError, or end the command, if finalists cannot be judged; before anything takes time."""
    if options.finalists is None:
        if options.judge_on:
            raise SeipError("--judge-on names the traffic in which finalists are judged: add --finalists")
        return
    require_judged(objective)
    importlib.import_module("headless.detection")  # ends the command where there is no PyTorch
    if not _known_runs(options):
        _map_of(options.scene)


def judge(surveyed: Survey, watch: survey.Stopwatch, solution: Solution, options: argparse.Namespace) -> Solution:
    """Choose among finalists by detection, print their figures, and return the solution of the winner."""
    from headless.detection.judging import judge_finalists  # noqa: PLC0415  # needs torch

    finalists = watch.run("finalists", find_finalists(surveyed, solution, options.finalists))
    request = judgement_request(surveyed, solution.objective.shares, finalists)
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
    """Return the finalists with their average precision in the frames by which they were judged, the best first."""
    names = [*judgement.weights, MEAN]
    rows = ["frames  " + "  ".join(f"{name:>12}" for name in names) + "  finalist"]
    best = sorted(judgement.finalists, key=lambda one: (-one.frames, -one.precision[MEAN].value))
    for one in best:
        cells = (f"{one.precision[name].value:12.1%}" if name in one.precision else f"{'–':>12}" for name in names)
        rows.append(f"{one.frames:6}  {'  '.join(cells)}  {one.name}: {'; '.join(one.sensors)}")
    return "\n".join([*rows, *judgement.sentences()])
