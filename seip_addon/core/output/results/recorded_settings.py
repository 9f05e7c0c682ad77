"""Settings in a ``placement.json`` that this program reads again."""

from __future__ import annotations

from dataclasses import dataclass

from ...choosing.placement.objective import Objective
from ...choosing.placement.search_limits import DEFAULT_EFFORT
from ...sensing.visibility.settings import Engine, VisibilitySettings
from ...sensing.weather import Weather
from ...site.candidates import CandidateSettings
from ...site.installed_cost import InstalledCost


@dataclass(frozen=True)
class RecordedSettings:
    """Settings of a placement; records of earlier versions may lack all but the objective and the sensor types.

    Parameters
    ----------
    goal : Objective
    catalogue : tuple of str
        Names of the user's own catalogues, without their folders.
    render : bool
        Whether the result includes a rendered view.
    """

    goal: Objective
    candidates: CandidateSettings
    visibility: VisibilitySettings = VisibilitySettings()
    weather: Weather = Weather()
    grid_spacing_m: float = 1.0
    catalogue: tuple[str, ...] = ()
    engine: Engine = "auto"
    solver: str = "auto"
    effort: float = DEFAULT_EFFORT
    installed_cost: InstalledCost | None = None
    render: bool = False
