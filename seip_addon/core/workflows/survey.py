"""Surveys: site layout and visibility grid."""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..choosing.placement.integer_program import check_solver
from ..choosing.placement.search_limits import DEFAULT_EFFORT, SolverLimits
from ..output.results.headings import tilt_degrees
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


@dataclass(frozen=True)
class SurveySettings:
    """Settings of a survey and of the searches on it.

    Parameters
    ----------
    grid_spacing : float, metres
        Distance between neighbouring targets.
    catalogue : tuple of path
        The user's own catalogues of LiDARs.
    engine : {"auto", "bvh", "embree"}
        Ray-casting engine.
    solver : str
        Solver of integer programs: ``auto``, ``highs``, ``cbc`` or ``gurobi``; ``auto`` is HiGHS if it is installed,
        otherwise CBC.
    time_limit : float, seconds, optional
        Limit of the wall time of each search.
    effort : float, units of work, optional
        Limit of the counted work of each search, which makes results reproducible: see `SolverLimits`.
    installed_cost : InstalledCost, optional
        Cost of installation to include in every price; by default prices are those of sensors only.
    spacings_because : str
        Reason for the spacings of targets and candidates; empty if the user chose them.
    """

    candidates: CandidateSettings = field(default_factory=CandidateSettings)
    visibility: VisibilitySettings = field(default_factory=VisibilitySettings)
    weather: Weather = field(default_factory=Weather)
    reflectivity: tuple[str, ...] = ()
    grid_spacing: float = setting(1.0, "distance between neighbouring targets on the road", unit="m", option="grid")
    catalogue: tuple[Path, ...] = setting((), "catalogues of your own; a unit's beams as KEY=FILE", metavar="FILE")
    engine: Engine = setting("auto", "ray caster")
    solver: str = setting("auto", "auto (HiGHS if it is installed, otherwise CBC), highs, cbc or gurobi")
    effort: float | None = setting(
        None,
        f"limit of each search in counted work, 1 is about a second of a core ({DEFAULT_EFFORT:g})",
        metavar="UNITS",
    )
    time_limit: float | None = setting(None, "limit of each search in seconds, in place of counted work", metavar="S")
    installed_cost: InstalledCost | None = None
    spacings_because: str = ""

    def models(self) -> dict[str, LidarModel]:
        """Return the sensor types to choose from, in the given weather, by catalogue key.

        Raises
        ------
        SeipError
            The solver or a type is unknown, a limit is not a positive number, a catalogue cannot be read, or a type
            detects nothing with the required probability.
        """
        check_solver(self.solver)
        self.limits.clock()  # rejects invalid limits before any ray is cast
        models = find_models(load_catalogue(self.catalogue), self.candidates.sensors)
        for model in models.values():
            self.visibility.least_strength(model)
        return {key: self.weather.through(model) for key, model in models.items()}

    @property
    def limits(self) -> SolverLimits:
        """Solver and limits of a search."""
        return SolverLimits(self.solver, self.time_limit, self.effort)

    def reach(self, models: Mapping[str, LidarModel] | None = None) -> float:
        """Return the largest distance from a target at which a ray that sees it can begin or be stopped, in metres.

        Parameters
        ----------
        models : mapping of str to LidarModel, optional
            Sensor types that `models` has returned; by default they are loaded again.
        """
        types = self.models() if models is None else models
        return max(model.max_range for model in types.values()) + self.visibility.delta

    def as_record(self) -> dict[str, Any]:
        """Return the settings for records, defaults included, as values that JSON can represent."""
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
    """Return a record without infinite values, which JSON cannot represent."""
    return {name: value for name, value in record.items() if math.isfinite(value)}


def _candidates_record(settings: CandidateSettings) -> dict[str, Any]:
    record = asdict(settings)
    tilts = record.pop("tilts")
    return record | {"tilts_deg": [tilt_degrees(tilt) for tilt in tilts]}


@dataclass(frozen=True, eq=False)
class Layout:
    """A scene with targets and candidates for a survey.

    Parameters
    ----------
    geometry : SceneGeometry
        Geometry of the scene.
    models : dict of str to LidarModel
        Sensor types to choose from, by catalogue key.
    warnings : tuple of str
        Warnings about the accuracy of the figures.
    """

    geometry: SceneGeometry
    site: Site
    models: dict[str, LidarModel]
    settings: SurveySettings
    warnings: tuple[str, ...]


def lay_out(geometry: SceneGeometry, settings: SurveySettings, warnings: Sequence[str] = ()) -> Layout:
    """Place targets and candidates in a scene.

    Parameters
    ----------
    warnings : sequence of str
        Warnings from reading the scene.

    Raises
    ------
    SeipError
        Same as for `SurveySettings.models` and `make_site`.
    """
    models = settings.models()
    reach = settings.reach(models)
    geometry = settings.weather.over(geometry)
    site = make_site(geometry, settings.candidates, settings.grid_spacing, reach, models)
    if settings.installed_cost is not None:
        candidates = settings.installed_cost.over(site.candidates, settings.candidates.bracket)
        site = replace(site, candidates=candidates)
    near, far = without_far_objects(geometry, geometry.region, reach)
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
    """Return a warning about sensor types that no weather affects, and on comparing them with types that it affects."""
    types = [key for key, model in models.items() if isinstance(model.law, CarlaDropoff)]
    others = [key for key in models if key not in types]
    changed = settings.weather != Weather() or settings.visibility.detection != VisibilitySettings().detection
    if not types or not (others or changed):
        return ()
    named = f"{', '.join(types)}: every return in range counts (CARLA's model), whatever the weather and the surface"
    return (f"{named}; {', '.join(others)} must detect it: do not compare the two" if others else named,)


@dataclass(frozen=True, eq=False)
class Survey(Layout):
    """A layout with its visibility grid.

    Parameters
    ----------
    returns_path : path, optional
        File of the returns grid, read and written when a placement is chosen for returns; None to keep it in memory
        only.
    """

    grid: VisibilityGrid
    returns_path: Path | None = None


def grid_key(layout: Layout) -> str:
    """Return the key of the visibility grid of a survey, by which it is stored."""
    settings = layout.settings
    return visibility_key(layout.site, layout.models, settings.visibility, engine_name(settings.engine))


def see(
    layout: Layout, path: Path, scheduler: str | None = None, threads: int | None = None
) -> Generator[Progress, None, Survey]:
    """Compute the visibility grid of a layout, or read it from a file if it was computed from the same inputs.

    Parameters
    ----------
    path : path
        File of the grid, read and written.
    scheduler : str, optional
        Address of a Dask scheduler whose workers compute the grid.
    threads : int, optional
        Maximum number of threads.
    """
    settings = layout.settings
    grid = yield from stored_visibility(
        path, layout.site, layout.models, settings.visibility, settings.engine, scheduler, threads
    )
    return with_grid(layout, grid, path)


def with_grid(layout: Layout, grid: VisibilityGrid, path: Path | None = None) -> Survey:
    """Return the survey of a layout with a given visibility grid; ``path`` is the file that it is stored in, if any."""
    returns_path = None if path is None else path.with_suffix(".returns.npz")
    return Survey(**{**vars(layout), "grid": grid, "returns_path": returns_path})


def estimate(layout: Layout, threads: int | None = None) -> Generator[Progress, None, Estimate]:
    """Estimate the run time and memory of `see` without a stored grid; see `estimate_visibility`."""
    settings = layout.settings
    return estimate_visibility(layout.site, layout.models, settings.visibility, settings.engine, threads)


def surroundings(layout: Layout) -> Surroundings:
    """Return the inputs of visibility from arbitrary poses in a survey."""
    settings = layout.settings
    return Surroundings(layout.site, layout.models, settings.visibility, layout.geometry.occluders, settings.engine)
