"""Runs of simulated traffic for a scene, in a folder of their own.

The panel makes several runs with `simulate_runs`; the command makes one with the same settings and `simulate_run`.
"""

import math
from collections.abc import Generator, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from ..base.counts import counted
from ..base.errors import SeipError
from ..base.progress import Progress, within
from ..base.settings import setting
from ..sensing.traffic.trajectories import Trajectories
from ..site.scene_geometry import SceneGeometry
from ..storage.files import content_fault, locked, parse_json, read_small, save_json, unfinished_name
from ..storage.json_dataclass import as_json
from ..world.traffic_simulation.demand import Demand
from ..world.traffic_simulation.simulation import Scenario, SignalPlan, SimulatedRun, simulate_run
from .traffic_runs import runs_in

SIMULATION = "simulation.json"
"""File of a folder of simulated runs that lists them with their settings."""
DEFAULT_RUNS = 4
"""Number of runs: the least for an interval of the average precision; a placement in traffic holds out the last."""

_MAX_RECORD = 1_000_000  # bytes


@dataclass(frozen=True)
class SimulationSettings:
    """Settings of runs of simulated traffic, which differ by their seeds.

    Parameters
    ----------
    demand : Demand
    signals : SignalPlan
    duration : float, seconds
        Duration of a run.
    warm_up : float, seconds
        Simulated time before a run begins.
    """

    demand: Demand = field(default_factory=Demand)
    signals: SignalPlan = field(default_factory=SignalPlan)
    duration: float = setting(120.0, "duration of the trajectories", metavar="S")
    warm_up: float = setting(120.0, "duration of the simulation before the trajectories", metavar="S")

    def __post_init__(self) -> None:
        if not 0.0 < self.duration < math.inf or not 0.0 <= self.warm_up < math.inf:
            raise SeipError("--duration must be above 0 s, and --warm-up not below 0 s")

    def run(
        self, map_path: Path, seed: int, geometry: SceneGeometry, sumo: Iterable[Path] = ()
    ) -> Generator[Progress, None, SimulatedRun]:
        """Simulate the run with a seed; see `simulate_run`."""
        scenario = Scenario(self.demand, self.signals, seed, self.warm_up + self.duration)
        return simulate_run(map_path, scenario, self.warm_up, geometry, sumo)


@dataclass(frozen=True, eq=False)
class SimulatedRuns:
    """Runs of simulated traffic in a folder.

    Parameters
    ----------
    paths : tuple of path
        Their files, in the order of their seeds.
    first : Trajectories
        Trajectories of the first run.
    road_users : int
        Number of road users in all runs.
    collided : int
        Number of road users left out because they had run into others.
    warnings : tuple of tuple of str
        Warnings of each run.
    """

    paths: tuple[Path, ...]
    first: Trajectories
    road_users: int
    collided: int
    warnings: tuple[tuple[str, ...], ...]

    @property
    def messages(self) -> list[str]:
        """Warnings of all runs, each with the name of its file."""
        each = zip(self.paths, self.warnings, strict=True)
        return [f"{path.name}: {warning}" for path, warnings in each for warning in warnings]

    @property
    def summary(self) -> str:
        """Numbers of runs and road users, as text."""
        left_out = f" ({self.collided:,} left out, having run into others)" if self.collided else ""
        return f"{counted(len(self.paths), 'run')}, {counted(self.road_users, 'road user')}{left_out}"


def simulate_runs(
    map_path: Path,
    settings: SimulationSettings,
    count: int,
    geometry: SceneGeometry,
    folder: Path,
    sumo: Iterable[Path] = (),
) -> Generator[Progress, None, SimulatedRuns]:
    """Simulate runs of traffic with the seeds 1, 2, … and write them to a folder, all or none.

    Each file ``run-SEED.npz`` is that of ``seip traffic --simulate`` with the same seed and settings. Runs of an
    earlier simulation in the folder are replaced.

    Parameters
    ----------
    count : int
        Number of runs.
    sumo : iterable of path
        Folders to search for SUMO first, as in `find_sumo`.

    Raises
    ------
    SeipError
        SUMO is missing or rejects the map, a run has no road users, the folder cannot be written, or it contains other
        runs.
    """
    if count < 1:
        raise SeipError(f"the number of runs must be 1 or more, not {count}")
    with locked(folder, folder=True):
        earlier = _earlier_runs(folder)
        runs: list[SimulatedRun] = []
        with TemporaryDirectory(prefix=unfinished_name(folder, "runs-").name, dir=folder) as temporary:
            for number in range(count):
                whole = Progress(number, count, f"simulating run {number + 1} of {count}")
                yield whole
                run = yield from within(whole, settings.run(map_path, number + 1, geometry, sumo))
                run.trajectories.save(Path(temporary) / _name(number + 1))
                runs.append(run)
            names = [_name(number + 1) for number in range(count)]
            save_json(folder / SIMULATION, {"map": map_path.name, "settings": as_json(settings), "runs": names})
            for name in names:
                (Path(temporary) / name).replace(folder / name)
            for path in earlier:
                if path.name not in names:
                    path.unlink(missing_ok=True)
    return SimulatedRuns(
        paths=tuple(folder / name for name in names),
        first=runs[0].trajectories,
        road_users=sum(len(run.trajectories) for run in runs),
        collided=sum(len(run.collided) for run in runs),
        warnings=tuple(run.warnings for run in runs),
    )


def _name(seed: int) -> str:
    return f"run-{seed}.npz"


def _earlier_runs(folder: Path) -> list[Path]:
    """Return the runs of an earlier simulation in a folder.

    Raises
    ------
    SeipError
        The folder contains other runs, which would be mixed with those of the simulation.
    """
    listed = listed_runs(folder / SIMULATION)
    present = runs_in(folder)
    others = [path.name for path in present if path.name not in listed]
    if others:
        raise SeipError(
            f"{folder} contains other runs of traffic ({others[0]}), and simulated runs need a folder of their own: "
            "choose another one"
        )
    return present


def listed_runs(path: Path) -> set[str]:
    """Return the names of the runs that a `SIMULATION` lists, none if there is no such file.

    Raises
    ------
    SeipError
        The file cannot be read or is damaged.
    """
    if not path.exists():
        return set()
    try:
        record = parse_json(read_small(path, _MAX_RECORD, "choose another folder").decode("utf-8"))
        return {str(name) for name in record["runs"]}
    except (ValueError, LookupError, TypeError, RecursionError) as error:
        raise SeipError(f"{path} is damaged ({content_fault(error)}): choose another folder") from error
