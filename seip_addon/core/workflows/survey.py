"""Surveys: site layout and visibility grid, and the record of a placement on them."""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..choosing.placement.deployment import deploy, pose_prices
from ..choosing.placement.integer_program import check_solver
from ..choosing.placement.objective import Solution, target_weights
from ..choosing.placement.search_limits import DEFAULT_EFFORT, SolverLimits
from ..errors import SeipError
from ..output.results.headings import tilt_degrees
from ..output.results.located import LOCATED_FILES, missing_sentence
from ..output.results.placement_record import PlacementRecord, Provenance, placement_record
from ..progress import Progress
from ..sensing.lidar.carla_dropoff import CarlaDropoff
from ..sensing.lidar.catalogue import find_models, load_catalogue
from ..sensing.lidar.model import LidarModel
from ..sensing.visibility.estimate import Estimate, estimate_visibility
from ..sensing.visibility.float32_precision import rounding_warnings
from ..sensing.visibility.grid import VisibilityGrid, visibility_key
from ..sensing.visibility.ray_casting import Engine, engine_name
from ..sensing.visibility.ring_resolution import resolution_warnings
from ..sensing.visibility.road_range import range_warnings, road_reflectivity
from ..sensing.visibility.settings import VisibilitySettings
from ..sensing.visibility.store import stored_visibility
from ..sensing.visibility.surroundings import Surroundings
from ..settings import setting
from ..site.candidates import CandidateSettings, assumed_pole_warnings
from ..site.far_objects import without_far_objects
from ..site.installed_cost import InstalledCost
from ..site.obstruction import bareness_warnings
from ..site.scene_geometry import SceneGeometry
from ..site.site import Site, make_site
from ..site.weather import Weather
from ..storage.files import digest
from ..storage.json_dataclass import as_json
from .returns import stored_pedestrian_returns


@dataclass(frozen=True)
class SurveySettings:
    """All that a user may choose about a survey and how it is answered.

    Parameters
    ----------
    grid_spacing : float, metres
        Between neighbouring targets.
    catalogue : tuple of path
        The user's own catalogues of LiDARs.
    engine : {"auto", "bvh", "embree"}
        What casts the rays.
    solver : str
        ``auto``, ``highs``, ``cbc`` or ``gurobi``; ``auto`` is HiGHS where it is installed, else CBC.
    time_limit : float, seconds, optional
        Limit of the wall time of each search.
    effort : float, units of work, optional
        Limit of the counted work of each search, which gives the same result again: see `SolverLimits`.
    installed_cost : InstalledCost, optional
        Counted in every price where it is given; else prices are those of sensors alone.
    spacings_because : str
        Why the spacings of targets and candidates are what they are; empty where the user chose them.
    """

    candidates: CandidateSettings = field(default_factory=CandidateSettings)
    visibility: VisibilitySettings = field(default_factory=VisibilitySettings)
    weather: Weather = field(default_factory=Weather)
    reflectivity: tuple[str, ...] = ()
    grid_spacing: float = setting(1.0, "distance between neighbouring targets on the road", unit="m", option="grid")
    catalogue: tuple[Path, ...] = setting((), "catalogues of your own; a unit's beams as KEY=FILE", metavar="FILE")
    engine: Engine = setting("auto", "ray caster")
    solver: str = setting("auto", "auto (HiGHS where it is installed, else CBC), highs, cbc or gurobi")
    effort: float | None = setting(
        None,
        f"limit of each search in counted work, 1 is about a second of a core ({DEFAULT_EFFORT:g})",
        metavar="UNITS",
    )
    time_limit: float | None = setting(None, "limit of each search in seconds, in place of counted work", metavar="S")
    installed_cost: InstalledCost | None = None
    spacings_because: str = ""

    def models(self) -> dict[str, LidarModel]:
        """Return the sensor types to choose from as they look through the weather, by catalogue key.

        Raises
        ------
        SeipError
            The solver or a type is unknown, a limit is no positive number, a catalogue cannot be read, or a type
            detects nothing with the probability that is asked for.
        """
        check_solver(self.solver)
        self.limits.clock()  # refuses what is no limit before any ray is cast
        models = find_models(load_catalogue(self.catalogue), self.candidates.sensors)
        for model in models.values():
            self.visibility.least_strength(model)
        return {key: self.weather.through(model) for key, model in models.items()}

    @property
    def limits(self) -> SolverLimits:
        """The solver, and how long it searches."""
        return SolverLimits(self.solver, self.time_limit, self.effort)

    def reach(self) -> float:
        """Return how far from a target a ray that sees it can begin, or be stopped, in metres."""
        return max(model.max_range for model in self.models().values()) + self.visibility.delta

    def as_record(self) -> dict[str, Any]:
        """Return the settings as records hold them: defaults included, values that JSON knows."""
        limits = _finite({"time_limit_s": self.time_limit or math.inf, "effort": self.limits.work})
        return {
            "grid_spacing_m": self.grid_spacing,
            "candidates": _candidates_record(self.candidates),
            "visibility": asdict(self.visibility),
            "weather": _finite(asdict(self.weather)),
            "reflectivity": list(self.reflectivity),
            "catalogue": [path.name for path in self.catalogue],
            "engine": self.engine,
            "solver": self.solver,
            "installed_cost": self.installed_cost and asdict(self.installed_cost),
            "spacings_because": self.spacings_because,
            **limits,
        }


def _finite(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return a record without what is infinite, which JSON does not know."""
    return {name: value for name, value in record.items() if math.isfinite(value)}


def _candidates_record(settings: CandidateSettings) -> dict[str, Any]:
    record = asdict(settings)
    tilts = record.pop("tilts")
    return record | {"tilts_deg": [tilt_degrees(tilt) for tilt in tilts]}


@dataclass(frozen=True, eq=False)
class Layout:
    """A scene laid out for a survey.

    Parameters
    ----------
    geometry : SceneGeometry
        What was read from the scene.
    models : dict of str to LidarModel
        The sensor types asked for, by catalogue key.
    warnings : tuple of str
        What a user should know before trusting the figures.
    """

    geometry: SceneGeometry
    site: Site
    models: dict[str, LidarModel]
    settings: SurveySettings
    warnings: tuple[str, ...]


def lay_out(geometry: SceneGeometry, settings: SurveySettings, warnings: Sequence[str] = ()) -> Layout:
    """Lay targets and candidates into a scene.

    Parameters
    ----------
    warnings : sequence of str
        Of the scene's reading.

    Raises
    ------
    SeipError
        As for `SurveySettings.models` and `make_site`.
    """
    models = settings.models()
    geometry = settings.weather.over(geometry)
    site = make_site(geometry, settings.candidates, settings.grid_spacing, settings.reach(), models)
    if settings.installed_cost is not None:
        candidates = settings.installed_cost.over(site.candidates, settings.candidates.bracket)
        site = replace(site, candidates=candidates)
    near, far = without_far_objects(geometry, geometry.region, settings.reach())
    limits = (
        *far,
        *bareness_warnings(near, np.concatenate([site.candidates.xyz[:, :2], site.targets.xyz[:, :2]])),
        *assumed_pole_warnings(geometry, site.candidates),
        *rounding_warnings(near),
        *resolution_warnings(site, models, settings.visibility),
        *carla_warnings(models, settings),
        *range_warnings(site, models, road_reflectivity(geometry.roads), settings.visibility),
    )
    return Layout(geometry, site, models, settings, (*warnings, *limits))


def carla_warnings(models: Mapping[str, LidarModel], settings: SurveySettings) -> tuple[str, ...]:
    """Say which sensor types see through any weather, and whether they are compared with types that do not."""
    types = [key for key, model in models.items() if isinstance(model.law, CarlaDropoff)]
    others = [key for key in models if key not in types]
    changed = settings.weather != Weather() or settings.visibility.detection != VisibilitySettings().detection
    if not types or not (others or changed):
        return ()
    named = f"{', '.join(types)}: every return in range counts (CARLA's model), whatever the weather and the surface"
    return (f"{named}; {', '.join(others)} must detect it: the two do not compare" if others else named,)


@dataclass(frozen=True, eq=False)
class Survey(Layout):
    """A layout with its visibility grid.

    Parameters
    ----------
    returns_path : path, optional
        File of the returns grid, read and written when a placement is chosen by it; None to keep it in memory only.
    """

    grid: VisibilityGrid
    returns_path: Path | None = None


def grid_key(layout: Layout) -> str:
    """Return the key of the visibility grid of a survey: what it is kept under."""
    settings = layout.settings
    return visibility_key(layout.site, layout.models, settings.visibility, engine_name(settings.engine))


def inputs_of(layout: Layout) -> dict[str, str]:
    """Return digests of what a placement follows from: of the visibility grid, and of all else about the site.

    Two layouts with the same digests have the same answers to the same objective.
    """
    targets, candidates = layout.site.targets, layout.site.candidates
    site = digest(
        *(targets.weight, targets.central, candidates.position_name, candidates.position_of),
        *(candidates.mandatory, candidates.mandatory_name, pose_prices(candidates, layout.models)),
    )
    return {"visibility": grid_key(layout), "site": site}


def see(
    layout: Layout, path: Path, scheduler: str | None = None, threads: int | None = None
) -> Generator[Progress, None, Survey]:
    """Find which pose sees which target, or read it from a file where an earlier survey found the same.

    Parameters
    ----------
    path : path
        The grid's file, read and written.
    scheduler : str, optional
        Address of a Dask scheduler whose workers do the work.
    threads : int, optional
        How many cast at once at most.
    """
    settings = layout.settings
    grid = yield from stored_visibility(
        path, layout.site, layout.models, settings.visibility, settings.engine, scheduler, threads
    )
    return with_grid(layout, grid, path)


def with_grid(layout: Layout, grid: VisibilityGrid, path: Path | None = None) -> Survey:
    """Return the survey of a layout whose visibility grid is known, and stored in the file ``path`` if there is one."""
    returns_path = None if path is None else path.with_suffix(".returns.npz")
    return Survey(**{**vars(layout), "grid": grid, "returns_path": returns_path})


def estimate(layout: Layout, threads: int | None = None) -> Generator[Progress, None, Estimate]:
    """Estimate what `see` will take where nothing is known yet; see `estimate_visibility`."""
    settings = layout.settings
    return estimate_visibility(layout.site, layout.models, settings.visibility, settings.engine, threads)


def surroundings(layout: Layout) -> Surroundings:
    """Return where the sensors of a survey may hang, and what they see there."""
    settings = layout.settings
    return Surroundings(layout.site, layout.models, settings.visibility, layout.geometry.occluders, settings.engine)


def record_of(survey: Survey, solution: Solution, provenance: Provenance, *, render: bool = False) -> PlacementRecord:
    """Return what ``placement.json`` holds of a solution.

    Parameters
    ----------
    render : bool
        Whether a rendered view belongs to the result.
    """
    objective = {"goal": as_json(solution.objective), "render": render}
    missing = missing_sentence(survey.site, LOCATED_FILES)
    notes = (*solution.notes, *([missing] if missing else []))
    return placement_record(
        survey.site,
        replace(solution, placement=replace(solution.placement, notes=notes)),
        provenance,
        settings={**survey.settings.as_record(), **objective},
        inputs=inputs_of(survey) | {"visibility": survey.grid.key},
        warnings=survey.warnings,
    )


def restored_solution(survey: Survey, record: PlacementRecord) -> Solution:
    """Return the solution that a record of `record_of` tells of, without asking a solver again.

    Parameters
    ----------
    survey : Survey
        That it was made on.
    record : PlacementRecord
        The greedy answer that it may hold is left out.

    Raises
    ------
    SeipError
        The record is of another grid, or names a pose that is none of its candidates.
    """
    site, grid = survey.site, survey.grid
    poses = range(len(site.candidates))
    if record.inputs.get("visibility") != grid.key or not all(sensor.pose in poses for sensor in record.sensors):
        raise SeipError("the placement was made for another state of the scene or its settings: place again")
    objective, chosen = record.asked.goal, record.poses
    covered = float(target_weights(site, objective)[grid.times_seen(chosen) > 0].sum())
    deployment = deploy(site, survey.models, grid.visible, chosen)
    known = replace(deployment, gain_band=record.coverage.gain_band, returns=record.returns)
    if record.returns is not None:
        known = replace(known, pedestrian_returns=stored_pedestrian_returns(survey, chosen))
    return Solution(objective, record.placement(covered), None, known)
