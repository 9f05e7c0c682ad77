"""A run of simulated traffic on the road of a scene."""

import tempfile
from collections.abc import Generator, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...progress import Progress
from ...sensing.traffic.floating_car_data import Extent
from ...sensing.traffic.overlaps import without_overlaps
from ...sensing.traffic.road_fit import fit_to_road
from ...sensing.traffic.smooth_walks import smooth_walks
from ...sensing.traffic.source import ROAD_MARGIN, TrafficFiles, read_sumo, road_bounds
from ...sensing.traffic.trajectories import Trajectories
from ...site.scene_geometry import SceneGeometry
from .simulation import Scenario, simulate


@dataclass(frozen=True, eq=False)
class SimulatedRun:
    """A run of traffic: its trajectories from time 0 on, with notes on its simulation.

    Parameters
    ----------
    simulated : int
        Number of road users, including those removed because they overlapped others.
    collided : tuple of str
        Names of the removed road users.
    warnings : tuple of str
    """

    trajectories: Trajectories
    simulated: int
    collided: tuple[str, ...]
    warnings: tuple[str, ...]


def simulate_run(
    map_path: Path, scenario: Scenario, warm_up: float, geometry: SceneGeometry, sumo: Iterable[Path] = ()
) -> Generator[Progress, None, SimulatedRun]:
    """Simulate traffic on a scene's map and fit it to the road of the scene.

    Parameters
    ----------
    scenario : Scenario
        Its duration includes the warm-up.
    warm_up : float, seconds
        Simulated time before the run begins.
    sumo : iterable of Path
        Folders to search for SUMO first, as in `find_sumo`.

    Raises
    ------
    SeipError
        SUMO is missing or rejects the map, or there are no road users on the road.
    """
    demand = scenario.demand
    with tempfile.TemporaryDirectory() as folder:
        files = yield from simulate(map_path, Path(folder), scenario, road_bounds(geometry, 0.0), sumo)
        source = f"SUMO on {map_path.name}, {demand.flow:g} vehicles per hour and arm, seed {scenario.seed}"
        return (yield from recorded_run(files, (warm_up, scenario.duration), geometry, source))


def recorded_run(
    files: TrafficFiles, span: tuple[float, float], geometry: SceneGeometry, source: str
) -> Generator[Progress, None, SimulatedRun]:
    """Read trajectories recorded by SUMO and fit them to the road of a scene.

    Parameters
    ----------
    span : (float, float), seconds
        Begin and end of the run in the simulation.
    source : str
        Source of the trajectories, for messages.

    Raises
    ------
    SeipError
        There are no road users on the road.
    """
    read = yield from read_sumo(files, Extent(*span, road_bounds(geometry, ROAD_MARGIN)), geometry, source)
    fit = fit_to_road(smooth_walks(read.trajectories), geometry)
    apart, collided = yield from without_overlaps(fit.trajectories)
    return SimulatedRun(
        trajectories=replace(apart, time=np.round(apart.time - span[0], 3)),
        simulated=len(fit.trajectories),
        collided=collided,
        warnings=(*read.warnings, *fit.warnings),
    )
