"""Coverage in rain, fog and on wet roads: limits of a placement for clear air, and remedies."""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

from seip_addon.core.base.arrays import Boolean, Integer
from seip_addon.core.base.progress import Progress, within
from seip_addon.core.choosing.placement.objective import Objective, placement_problem
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.weather import weather_of
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.workflows.survey import lay_out
from seip_addon.core.workflows.survey_settings import SurveySettings

from .page import Row

WEATHERS = (
    *("wet", "rain=5", "rain=20", "rain=50"),
    *("visibility=500", "visibility=200", "visibility=100", "visibility=50"),
)
"""Weathers, as values of the option ``--weather``."""

SENSOR, LONGER = "os1_128", "os1_128_rev7"
"""Type that is studied, and a type with a longer range."""

COUNT = 8
"""Number of sensors, enough to cover most of the shipped junction in clear air."""

FAILS_BELOW = 0.5  # of the targets


@dataclass(frozen=True)
class WeatherAnswer:
    """Coverage in one weather.

    Parameters
    ----------
    weather : str
        Weather, as a value of the option ``--weather``.
    kept : float
        Coverage of the best placement for clear air.
    placed : float
        Coverage of the best placement for this weather.
    longer : float
        Coverage of the best placement for this weather with sensors of longer range.
    gap : float
        Larger gap of the two placements for this weather to the best possible.
    """

    weather: str
    kept: float
    placed: float
    longer: float
    gap: float


def weather_study(
    geometry: SceneGeometry,
    settings: SurveySettings,
    *,
    types: tuple[str, str] = (SENSOR, LONGER),
    count: int = COUNT,
) -> Generator[Progress, None, list[WeatherAnswer]]:
    """Place sensors for clear air and for each weather, and evaluate all placements in the weather.

    Parameters
    ----------
    settings : SurveySettings
        Settings of the surveys; weather and types are replaced.
    types : two str
        Type that is studied, and a type with a longer range.
    count : int
        Number of sensors.

    Returns
    -------
    list of WeatherAnswer
        Answers for clear air (``""``) and each of `WEATHERS`.
    """
    answers: list[WeatherAnswer] = []
    chosen_in_clear_air: Integer | None = None
    for number, weather in enumerate(("", *WEATHERS)):
        progress = Progress(number, 1 + len(WEATHERS), weather or "clear air")
        visible, chosen, gap = yield from within(progress, _placed(geometry, settings, types[0], weather, count))
        longer, best_longer, longer_gap = yield from within(
            progress, _placed(geometry, settings, types[1], weather, count)
        )
        if chosen_in_clear_air is None:
            chosen_in_clear_air = chosen
        kept = _coverage(visible, chosen_in_clear_air)
        placed = _coverage(visible, chosen)
        answers.append(WeatherAnswer(weather, kept, placed, _coverage(longer, best_longer), max(gap, longer_gap)))
    return answers


def weather_rows(answers: Sequence[WeatherAnswer]) -> list[Row]:
    """Return the rows of the page: one for each weather after the first, which is clear air."""
    clear, *others = answers
    return [
        Row(
            f"coverage, {COUNT} × {SENSOR} placed for clear air",
            describe_weather(answer.weather),
            f"{f'fails, below {FAILS_BELOW:.0%}' if answer.kept < FAILS_BELOW else 'holds'}: {answer.kept:.1%}, "
            f"{(clear.placed - answer.kept) * 100:.1f} points less than in clear air",
            f"best placements for clear air and for the weather, evaluated in the weather; at most {answer.gap:.1%} "
            "below the best possible",
            f"`--weather {answer.weather}` places for it: {answer.placed:.1%}; {COUNT} × {LONGER} placed for it cover "
            f"{answer.longer:.1%}",
        )
        for answer in others
    ]


def describe_weather(words: str) -> str:
    """Return a description of a weather."""
    weather = weather_of(words.split())
    if math.isfinite(weather.visibility):
        return f"fog, visibility {weather.visibility:g} m"
    return f"rain of {weather.rain:g} mm/h" if weather.rain else "wet road"


def _placed(
    geometry: SceneGeometry, settings: SurveySettings, sensor: str, words: str, count: int
) -> Generator[Progress, None, tuple[Boolean, Integer, float]]:
    """Return the visibility grid of a type in a weather, the chosen poses, and the gap of that placement."""
    candidates, weather = replace(settings.candidates, sensors=(sensor,)), weather_of(words.split())
    layout = lay_out(geometry, replace(settings, candidates=candidates, weather=weather))
    grid = yield from compute_visibility(layout.site, layout.models, layout.settings.visibility, settings.engine)
    problem = placement_problem(layout.site, grid.visible, layout.models, Objective(count=count))
    placement = yield from solve(problem, settings.limits)
    return grid.visible, placement.chosen, placement.gap


def _coverage(visible: Boolean, chosen: Integer) -> float:
    return float(visible[chosen].any(axis=0).mean())
