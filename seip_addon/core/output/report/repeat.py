"""The command that repeats a placement, from what its record holds."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator
from dataclasses import replace

from ...choosing.placement.objective import Objective
from ...choosing.placement.scenarios import PoseErrors
from ...settings import Setting, settings_of
from ...site.installed_cost import load_installed_cost
from ...storage.json_dataclass import as_json
from ..results.placement_record import PlacementRecord
from ..results.recorded_settings import RecordedSettings


def repeating_command(record: PlacementRecord) -> str:
    """Return what to type in the folder of a result to have it again; empty where no one command makes it."""
    settings = record.request
    if record.objective.solver == "none" or settings.goal.scenarios.kind == "traffic":
        return ""  # moved by hand, or optimised on runs of traffic that the record does not name
    words = ["seip", "place", "placed.blend", *_options(settings.candidates), *_of_survey(settings)]
    words += [*_options(settings.visibility), *_of_objective(settings.goal)]
    words += [] if settings.render else ["--no-render"]
    return shlex.join([*words, "-o", "again"])


def _of_objective(objective: Objective) -> Iterator[str]:
    if objective.central_weight == "scene":
        objective = replace(objective, central_weight=None)
        yield "--weighted"
    yield from _options(objective)
    scenarios = objective.scenarios
    if scenarios.errs:
        yield "--pose-errors"
        if scenarios.pose_errors != PoseErrors():
            for name, value in as_json(scenarios.pose_errors).items():
                yield from (f"--{name.removesuffix('_deg')}-error", f"{value:.12g}")
        yield from _options(scenarios)


def _of_survey(settings: RecordedSettings) -> Iterator[str]:
    default = RecordedSettings(settings.goal, settings.candidates)
    for option, name in (
        ("grid", "grid_spacing_m"),
        ("engine", "engine"),
        ("solver", "solver"),
        ("time-limit", "time_limit_s"),
        ("effort", "effort"),
    ):
        value = getattr(settings, name)
        if value != getattr(default, name):
            yield from (f"--{option}", _typed(value))
    for name in ("catalogue", "reflectivity"):
        if getattr(settings, name):
            yield from (f"--{name}", *getattr(settings, name))
    if settings.weather.words():
        yield from ("--weather", *settings.weather.words())
    cost = settings.installed_cost
    if cost is not None:
        yield from ("--installed-cost", *([] if cost == load_installed_cost() else ["costs.toml"]))


def _options(settings: object) -> Iterator[str]:
    """Yield the options that set what differs from the defaults of a settings class."""
    for name, (about, default) in settings_of(type(settings)).items():
        value = getattr(settings, name)
        if value == default:
            continue
        yield f"--{about.option or name.replace('_', '-')}"
        if not isinstance(value, bool):
            yield from (_typed(_in_degrees(one, about)) for one in (value if isinstance(value, tuple) else (value,)))


def _in_degrees(value: object, about: Setting) -> object:
    return math.degrees(value) if about.unit == "rad" and isinstance(value, float) else value


def _typed(value: object) -> str:
    return f"{value:.12g}" if isinstance(value, float) else str(value)
