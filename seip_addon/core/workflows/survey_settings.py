"""Settings of a survey."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from ..base.settings import setting
from ..choosing.placement.integer_program import check_solver
from ..choosing.placement.search_limits import DEFAULT_EFFORT, SolverLimits
from ..sensing.lidar.catalogue import find_models, load_catalogue
from ..sensing.lidar.model import LidarModel
from ..sensing.visibility.settings import Engine, VisibilitySettings
from ..sensing.weather import Weather
from ..site.candidates import CandidateSettings
from ..site.installed_cost import InstalledCost
from ..storage.json_dataclass import as_json


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
    effort : float, units of work
        Limit of the counted work of each search, which makes results reproducible: see `SolverLimits`.
    installed_cost : InstalledCost, optional
        Cost of installation to include in every price; by default prices are those of sensors only.

    Examples
    --------
    >>> candidates = CandidateSettings(sensors=("type1", "vlp16"), tilts=(math.radians(12.0),))
    >>> settings = SurveySettings(candidates, grid_spacing=2.0)
    >>> models = settings.models()
    >>> list(models), settings.reach(models)
    (['type1', 'vlp16'], 101.0)
    >>> settings.as_record()["candidates"]["tilts_deg"]
    [12.0]
    """

    candidates: CandidateSettings = field(default_factory=CandidateSettings)
    visibility: VisibilitySettings = field(default_factory=VisibilitySettings)
    weather: Weather = field(default_factory=Weather)
    grid_spacing: float = setting(1.0, "distance between neighbouring targets on the road", unit="m", option="grid")
    catalogue: tuple[Path, ...] = setting((), "catalogues of your own", metavar="FILE")
    engine: Engine = "auto"
    solver: str = setting("auto", "auto (HiGHS if it is installed, otherwise CBC), highs, cbc or gurobi")
    effort: float = setting(
        DEFAULT_EFFORT,
        "limit of each search in counted work, 1 is about a second of a core",
        metavar="UNITS",
    )
    installed_cost: InstalledCost | None = setting(
        None, "include posts, power and backhaul in prices, from the shipped table or your own", metavar="TOML"
    )

    def models(self) -> dict[str, LidarModel]:
        """Return the sensor types to choose from, in the given weather, by catalogue key.

        Raises
        ------
        SeipError
            The solver or a type is unknown, a limit is not a positive number, a catalogue cannot be read, or a type
            detects nothing with the required probability.
        """
        check_solver(self.solver)
        _ = self.limits  # rejects invalid ones before any ray is cast
        models = find_models(load_catalogue(self.catalogue), self.candidates.sensors)
        for model in models.values():
            self.visibility.least_strength(model)
        return {key: self.weather.through(model) for key, model in models.items()}

    @property
    def limits(self) -> SolverLimits:
        """Solver and limits of a search."""
        return SolverLimits(self.solver, effort=self.effort)

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
        return {
            "grid_spacing_m": self.grid_spacing,
            "candidates": as_json(self.candidates),
            "visibility": asdict(self.visibility),
            "weather": _finite(asdict(self.weather)),
            "catalogue": [path.name for path in self.catalogue],
            "engine": self.engine,
            "solver": self.solver,
            "installed_cost": self.installed_cost and asdict(self.installed_cost),
            "effort": self.effort,
        }


def _finite(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return a record without infinite values, which JSON cannot represent."""
    return {name: value for name, value in record.items() if math.isfinite(value)}
