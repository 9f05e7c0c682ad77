"""Placement for the road in traffic as one job, from recorded runs to deployment."""

from __future__ import annotations

import re
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import TypeVar

from ..arrays import Float
from ..errors import SeipError
from ..limits import SCENARIOS
from ..placement.deployment import deploy
from ..placement.objective import CHOSEN_FOR, Objective, Solution, placement_problem, with_count
from ..progress import Progress
from ..robustness.gain_band import with_gain_band
from ..robustness.traffic_instants import check_runs, spread_instants
from ..robustness.traffic_presence import road_user_seconds
from ..robustness.traffic_study import LAYER_NAMES, TrafficStudy, traffic_scenarios, traffic_study, traffic_warnings
from ..robustness.visibility_in_traffic import TrafficLayer
from ..settings import setting
from ..site.site import Site
from ..traffic import Trajectories
from ..traffic.run_overlap import require_independent, vehicle_positions
from ..traffic.source import load_trajectories
from .robust import check_robust_objective
from .survey import Layout, Survey, surroundings

_Run = TypeVar("_Run")

EVALUATION_SHARE = 1 / 3
"""Share of the runs, the last ones, that placements are evaluated on and not optimised on."""


@dataclass(frozen=True)
class TrafficSettings:
    """Settings of placement for traffic: what must be seen, and how many instants are sampled.

    Parameters
    ----------
    layer : {"road", "height"}
        The targets on the road, or the points above them.
    weights_from_traffic : bool
        Whether targets weigh as many seconds as road users are there.

    Raises
    ------
    SeipError
        There is no instant to choose on, or none to evaluate by.
    """

    layer: TrafficLayer = setting("road", "what is to be seen: the road, or points at vehicles' height", option="see")
    weights_from_traffic: bool = setting(default=False, help="weigh targets by the time that road users are there")
    instants: int = setting(24, "instants of traffic to choose on", minimum=1, maximum=int(SCENARIOS.most), metavar="N")
    evaluation_instants: int = setting(
        120,
        "instants of other runs to evaluate on",
        minimum=1,
        maximum=int(SCENARIOS.most),
        option="judged-at",
        metavar="N",
    )
    seed: int = setting(0, "of the instants; those to evaluate on have the next", minimum=0)

    def __post_init__(self) -> None:
        for number in (self.instants, self.evaluation_instants):
            if not SCENARIOS.allow(number):
                raise SeipError(f"ask for {SCENARIOS} instants of traffic, not {number}")


@dataclass(frozen=True, eq=False)
class TrafficRuns:
    """Runs of traffic, split into those to optimise on and those to evaluate on.

    Parameters
    ----------
    optimisation, evaluation : list of Trajectories
        To optimise a placement on, and to evaluate it on.
    overlap : str
        Message on how much the two overlap.
    """

    optimisation: list[Trajectories]
    evaluation: list[Trajectories]
    overlap: str


@dataclass(frozen=True, eq=False)
class TrafficSolution:
    """A solution for traffic with the study that it comes from: objective, bound and gap are of coverage in traffic."""

    solution: Solution
    study: TrafficStudy


def split_runs(runs: Sequence[_Run]) -> tuple[list[_Run], list[_Run]]:
    """Return the runs to optimise on, and those to evaluate on."""
    last = max(1, round(EVALUATION_SHARE * len(runs)))
    return list(runs[:-last]), list(runs[-last:])


def traffic_folder(scene: Path, kind: str = "") -> Path:
    """Return the folder for runs beside the file of a scene: ``junction_traffic`` beside ``junction.blend``.

    Parameters
    ----------
    kind : str
        What else the folder's name ends with: ``_dense`` for ``junction_traffic_dense``.
    """
    return scene.parent / f"{scene.stem}_traffic{kind}"


def runs_in(folder: Path) -> list[Path]:
    """Return the files of runs in a folder by their names, numbers as such; none where there is no such folder."""

    def by_number(path: Path) -> list[tuple[int, str]]:
        return [(int(part), "") if part.isdecimal() else (0, part) for part in re.split(r"([0-9]+)", path.stem)]

    return sorted(folder.glob("*.npz"), key=by_number)


def found_runs(folder: Path) -> list[Path]:
    """Return the files of runs in a folder, one or more.

    Raises
    ------
    SeipError
        There is none.
    """
    paths = runs_in(folder)
    if not paths:
        raise SeipError(
            f"there is no run of traffic (.npz) in {folder}: choose another folder, or make two or more runs with "
            "headless/traffic.py, a seed each"
        )
    return paths


def load_runs(paths: Sequence[Path], origin: Float) -> list[Trajectories]:
    """Read runs, in the local axes of an origin."""
    return [Trajectories.load(path).moved_to(origin) for path in paths]


def read_runs(paths: Sequence[Path], layout: Layout) -> Generator[Progress, None, TrafficRuns]:
    """Read the runs that a survey's sensors are to be placed on.

    Raises
    ------
    SeipError
        A file is named twice or cannot be read, or as for `independent_runs`.
    """
    for path in paths:
        if paths.count(path) > 1:
            raise SeipError(f"{path} is named twice: name each run of traffic once")
    runs: dict[str, Trajectories] = {}
    for number, path in enumerate(paths):
        yield Progress(number, len(paths), "reading runs of traffic")
        runs[str(path)] = load_trajectories(path, layout.geometry)
    return independent_runs(runs, layout.site)


def independent_runs(runs: Mapping[str, Trajectories], site: Site) -> TrafficRuns:
    """Split runs, given by name in the axes of the site, and check that both parts show traffic of their own there.

    Raises
    ------
    SeipError
        There are fewer than two, one is of another place, or two are nearly the same.
    """
    if len(runs) < 2:
        raise SeipError(
            f"two runs of traffic or more are needed, not {len(runs)}: make them by headless/traffic.py with a seed "
            "each; what is chosen on the others is evaluated on the last third"
        )
    check_runs(list(runs.values()), site.region)
    positions = [vehicle_positions(name, run) for name, run in runs.items()]
    overlap = require_independent(product(*split_runs(positions)))
    return TrafficRuns(*split_runs(list(runs.values())), overlap)


def place_in_traffic(
    survey: Survey, objective: Objective, runs: TrafficRuns, settings: TrafficSettings
) -> Generator[Progress, None, TrafficSolution]:
    """Optimise a placement for traffic, whose vehicles block the view, and evaluate it on other runs.

    Parameters
    ----------
    objective : Objective
        Of most coverage.

    Raises
    ------
    SeipError
        As for `check_robust_objective`, `placement_problem` and `spread_instants`.
    """
    check_robust_objective(objective)
    site, models, visible = survey.site, survey.models, survey.grid.visible
    problem = placement_problem(site, visible, models, objective)
    if settings.weights_from_traffic:
        seconds = yield from road_user_seconds(site.targets, runs.optimisation)
        problem = replace(problem, weights=problem.weights * seconds)
    around = surroundings(survey)
    chosen_at = spread_instants(runs.optimisation, settings.instants, settings.seed)
    scenarios = yield from traffic_scenarios(around, problem, chosen_at, settings.layer)
    evaluation = spread_instants(runs.evaluation, settings.evaluation_instants, settings.seed + 1)
    study = yield from traffic_study(around, problem, scenarios, evaluation, survey.settings.limits)
    placement = study.traffic.placement
    note = (
        f"{CHOSEN_FOR}to see the {LAYER_NAMES[study.layer]} in traffic, on average over {study.chosen_at} instants: "
        "objective, bound and gap are of that"
    )
    weighed = ("targets weigh as many seconds as road users are there",) if settings.weights_from_traffic else ()
    notes = (note, *weighed, *placement.notes, *traffic_messages(study), *traffic_warnings(study))
    deployment = yield from with_gain_band(around, deploy(site, models, visible, placement.chosen))
    solution = Solution(with_count(objective, site), replace(placement, notes=notes), None, deployment)
    return TrafficSolution(solution, study)


def traffic_messages(study: TrafficStudy) -> tuple[str, ...]:
    """Describe what optimising on traffic gains or loses, and whether it was evaluated on too few instants."""
    seen = f"of the {LAYER_NAMES[study.layer]} than the best placement for the empty road"
    gain = f"this placement sees {study.gain(study.layer).as_change()} {seen}, in traffic that neither was chosen on"
    if study.is_converged():
        return (gain,)
    return gain, "half of the instants give a different result: evaluate on more instants"
