"""Coverage in rain, fog and on wet roads: limits of a fleet placed for clear air, and remedies."""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

from headless.studies.full_scan import beam_directions

import numpy as np

from seip_addon.core.arrays import Integer
from seip_addon.core.choosing.placement.objective import Objective, placement_problem
from seip_addon.core.choosing.placement.solver import solve
from seip_addon.core.progress import Progress, within
from seip_addon.core.sensing.lidar.noisy_returns import return_chance
from seip_addon.core.sensing.scans.scanner import ReflectiveSurface
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.scans.static_scene import static_scene
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.weather import Weather, weather_of
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.workflows.survey import Layout, Survey, grid_key, lay_out, with_grid
from seip_addon.core.workflows.survey_settings import SurveySettings

from .rows import Row

WEATHERS = (
    *("wet", "rain=5", "rain=20", "rain=50"),
    *("visibility=500", "visibility=200", "visibility=100", "visibility=50"),
)
"""Weathers, as values of the option ``--weather``."""

FLEET, LONGER = "os1_128", "os1_128_rev7"
"""Type that is studied, and a type with a longer range."""

FLEET_COUNT = 8
"""Number of sensors, enough to cover most of the shipped junction in clear air."""

FAILS_BELOW = 0.5  # of the targets


@dataclass(frozen=True)
class WeatherAnswer:
    """Coverage in one weather.

    Parameters
    ----------
    words : str
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

    words: str
    kept: float
    placed: float
    longer: float
    gap: float


@dataclass(frozen=True)
class WeatherStudy:
    """Coverage of a fleet by weather.

    Parameters
    ----------
    sensor, longer : str
        Types: the one studied, and the one with a longer range.
    clear, longer_clear : float
        Coverage of the best placements in clear air.
    """

    sensor: str
    longer: str
    count: int
    clear: float
    longer_clear: float
    answers: tuple[WeatherAnswer, ...]


@dataclass(frozen=True)
class UntouchedTypes:
    """Types whose coverage does not depend on the weather, and the effect of weather on scans.

    Parameters
    ----------
    sensors : tuple of str
        Types whose visibility has the same inputs in all weathers.
    placed : str
        Name of the sensors that scan.
    returned : mapping of str to float
        Share of the hits within the range that return, by weather, ``clear`` first.
    """

    sensors: tuple[str, ...]
    placed: str
    returned: dict[str, float]


def weather_study(
    geometry: SceneGeometry,
    settings: SurveySettings,
    *,
    types: tuple[str, str] = (FLEET, LONGER),
    count: int = FLEET_COUNT,
) -> Generator[Progress, None, WeatherStudy]:
    """Place sensors for clear air and for each weather, and evaluate all placements in the weather.

    Parameters
    ----------
    settings : SurveySettings
        Settings of the surveys; weather and types are replaced.
    types : two str
        Type that is studied, and a type with a longer range.
    count : int
        Number of sensors.

    Yields
    ------
    Progress
    """
    clear: dict[str, tuple[Integer, float]] = {}
    answers = []
    for done, words in enumerate(("", *WEATHERS)):
        found, gaps, kept = {}, [], 0.0
        for number, key in enumerate(types):
            progress = Progress(2 * done + number, 2 * (1 + len(WEATHERS)), f"{key}, {words or 'clear air'}")
            yield progress
            own = replace(settings.candidates, sensors=(key,))
            weather = weather_of(words.split())
            layout = lay_out(geometry, replace(settings, candidates=own, weather=weather))
            steps = compute_visibility(layout.site, layout.models, layout.settings.visibility, settings.engine)
            grid = yield from within(progress, steps)
            chosen, gap = yield from within(progress, _placed(with_grid(layout, grid), count))
            clear.setdefault(key, (chosen, grid.coverage(chosen)))
            found[key] = grid.coverage(chosen)
            gaps.append(gap)
            if key == types[0]:
                kept = grid.coverage(clear[key][0])
        answers.append(WeatherAnswer(words, kept, found[types[0]], found[types[1]], max(gaps)))
    return WeatherStudy(*types, count, clear[types[0]][1], clear[types[1]][1], tuple(answers[1:]))


def untouched_types(survey: Survey, placed: str, sensors: Sequence[MountedSensor]) -> UntouchedTypes:
    """Find the types of a survey whose visibility is the same in all weathers, and the loss of returns of scans.

    Parameters
    ----------
    survey : Survey
        Survey in clear air.
    placed : str
        Name of the sensors.
    sensors : sequence of MountedSensor
        Sensors that scan the static scene.
    """
    types = tuple(
        key for key in survey.models if len({grid_key(_one_type(survey, key, w)) for w in ("", *WEATHERS)}) == 1
    )
    returned = {
        words or "clear": _returned(survey.geometry, sensors, weather_of(words.split())) for words in ("", *WEATHERS)
    }
    return UntouchedTypes(types, placed, returned)


def weather_rows(study: WeatherStudy, untouched: UntouchedTypes) -> tuple[Row, ...]:
    """Return the rows of the page: one for each weather, and one for the types unaffected by weather."""
    rows = [_row(study, answer) for answer in study.answers]
    if untouched.sensors:
        clear, *others = untouched.returned.values()
        rows.append(
            Row(
                f"coverage, {', '.join(untouched.sensors)}",
                "the same weathers",
                "no effect: every return within the range counts (CARLA's drop-off); in scans of "
                f"{untouched.placed}, {clear:.1%} of the hits return in clear air and {min(others):.1%} in the worst "
                "of these weathers",
                "the inputs of visibility are the same in all weathers; probabilities of return of all rays, without "
                "traffic",
                "a warning that weather does not affect these types; use types with the range equation",
            )
        )
    return tuple(rows)


def describe_weather(words: str) -> str:
    """Return a description of a weather."""
    weather = weather_of(words.split())
    if math.isfinite(weather.visibility):
        return f"fog, visibility {weather.visibility:g} m"
    return f"rain of {weather.rain:g} mm/h" if weather.rain else "wet road"


def _row(study: WeatherStudy, answer: WeatherAnswer) -> Row:
    fails = answer.kept < FAILS_BELOW
    remedy = f"`--weather {answer.words}` places for it: {answer.placed:.1%}"
    return Row(
        f"coverage, {study.count} × {study.sensor} placed for clear air",
        describe_weather(answer.words),
        f"{f'fails, below {FAILS_BELOW:.0%}' if fails else 'holds'}: {answer.kept:.1%}, "
        f"{(study.clear - answer.kept) * 100:.1f} points less than in clear air",
        f"best placements for clear air and for the weather, evaluated in the weather; at most {answer.gap:.1%} below "
        "the best possible",
        f"{remedy}; {study.count} × {study.longer} placed for it cover {answer.longer:.1%}",
    )


def _placed(survey: Survey, count: int) -> Generator[Progress, None, tuple[Integer, float]]:
    problem = placement_problem(survey.site, survey.grid.visible, survey.models, Objective(count=count))
    placement = yield from solve(problem, survey.settings.limits)
    return placement.chosen, placement.gap


def _one_type(layout: Layout, key: str, words: str) -> Layout:
    settings = layout.settings
    own = replace(settings.candidates, sensors=(key,))
    return lay_out(layout.geometry, replace(settings, candidates=own, weather=weather_of(words.split())))


def _returned(geometry: SceneGeometry, sensors: Sequence[MountedSensor], weather: Weather) -> float:
    """Return the share of the hits within the range that return."""
    static = static_scene(weather.over(geometry))
    surface = ReflectiveSurface(make_ray_caster(static.triangles), static.reflectivity)
    chances = []
    for sensor in sensors:
        model = weather.through(sensor.model)
        directions = beam_directions(model).reshape(-1, 3) @ sensor.orientation.T
        distance, triangle = surface.caster.cast(sensor.xyz, directions, model.max_range)
        met = (triangle >= 0) & (distance >= model.min_range)
        reflected = surface.reflected(directions[met], triangle[met])
        chances.append(return_chance(model, distance[met], reflected))
    return float(np.mean(np.concatenate(chances)))
