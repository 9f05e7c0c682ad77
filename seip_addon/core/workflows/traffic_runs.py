"""Runs of traffic for a scene, split into those to optimise a placement on and those to evaluate it on."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TypeVar

from ..base.errors import SeipError
from ..base.progress import Progress
from ..sensing.traffic.run_overlap import require_independent, vehicle_positions
from ..sensing.traffic.site_traffic import check_runs, load_trajectories
from ..sensing.traffic.trajectories import Trajectories
from ..site.site import Site
from ..storage.files import natural_order
from .survey import Layout

_Run = TypeVar("_Run")

EVALUATION_SHARE = 1 / 3
"""Share of the runs that are held out for evaluation: the last ones."""


@dataclass(frozen=True, eq=False)
class TrafficRuns:
    """Runs of traffic, split into those to optimise on and those to evaluate on.

    Parameters
    ----------
    optimisation, evaluation : list of Trajectories
        Runs to optimise a placement on, and runs to evaluate it on.
    overlap : str
        Message on the overlap of the two.
    """

    optimisation: list[Trajectories]
    evaluation: list[Trajectories]
    overlap: str


def split_runs(runs: Sequence[_Run]) -> tuple[list[_Run], list[_Run]]:
    """Return the runs to optimise on, and those to evaluate on.

    Examples
    --------
    >>> folder = traffic_folder(Path("junction.blend"))
    >>> folder.mkdir()
    >>> for number in range(1, 11):
    ...     (folder / f"run-{number}.npz").touch()
    >>> optimisation, evaluation = split_runs(found_runs(folder))
    >>> len(optimisation), [path.stem for path in evaluation]
    (7, ['run-8', 'run-9', 'run-10'])
    """
    last = max(1, round(EVALUATION_SHARE * len(runs)))
    return list(runs[:-last]), list(runs[-last:])


def traffic_folder(scene: Path, kind: str = "") -> Path:
    """Return the folder for runs next to the file of a scene: ``junction_traffic`` for ``junction.blend``.

    Parameters
    ----------
    kind : str
        Ending of the folder's name: ``_dense`` for ``junction_traffic_dense``.
    """
    return scene.parent / f"{scene.stem}_traffic{kind}"


def runs_in(folder: Path) -> list[Path]:
    """Return the files of runs in a folder in natural order of their names; none if there is no such folder."""
    return sorted(folder.glob("*.npz"), key=natural_order)


def found_runs(folder: Path) -> list[Path]:
    """Return the files of runs in a folder, one or more.

    Raises
    ------
    SeipError
        There is no such file.
    """
    paths = runs_in(folder)
    if not paths:
        raise SeipError(
            f"there is no run of traffic (.npz) in {folder}: choose another folder, or make two or more runs with "
            "Simulate Traffic in the panel or with seip traffic, each with its own seed"
        )
    return paths


def read_runs(paths: Sequence[Path], layout: Layout) -> Generator[Progress, None, TrafficRuns]:
    """Read the runs of traffic for optimising a placement on a survey.

    Raises
    ------
    SeipError
        A file is named twice or cannot be read, or the same as for `independent_runs`.
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
    """Split runs, given by name in the axes of the site, and check that both parts are independent traffic of the site.

    Raises
    ------
    SeipError
        There are fewer than two runs, one belongs to another site, or two are nearly the same.
    """
    if len(runs) < 2:
        raise SeipError(
            f"two runs of traffic or more are needed, not {len(runs)}: make them with Simulate Traffic in the panel or "
            "with seip traffic, each with its own seed; the last third is held out for evaluation"
        )
    check_runs(list(runs.values()), site.region)
    positions = [vehicle_positions(name, run) for name, run in runs.items()]
    overlap = require_independent(product(*split_runs(positions)))
    return TrafficRuns(*split_runs(list(runs.values())), overlap)
