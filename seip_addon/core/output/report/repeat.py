"""The command that repeats a placement, from what its record holds."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

from ...choosing.placement.objective import Objective
from ...choosing.placement.scenarios import PoseErrors, Scenarios
from ...choosing.placement.search_limits import DEFAULT_EFFORT
from ...sensing.visibility.settings import VisibilitySettings
from ...settings import settings_of
from ...site.candidates import CandidateSettings
from ...site.installed_cost import load_installed_cost
from ...storage.json_dataclass import as_json
from ..results.placement_record import PlacementRecord

DEFAULT_GRID = 1.0  # metres, of `SurveySettings`


def repeating_command(record: PlacementRecord) -> str:
    """Return what to type in the folder of a result to have it again; empty where no one command makes it."""
    settings: Mapping[str, Any] = record.settings
    if record.objective.solver == "none" or record.request.goal.scenarios.kind == "traffic":
        return ""  # moved by hand, or optimised on runs of traffic that the record does not name
    words = ["seip", "place", "placed.blend", *_of_candidates(settings), *_of_survey(settings)]
    words += _options(VisibilitySettings, settings.get("visibility", {}))
    words += _of_objective(record.request.goal)
    words += [] if settings.get("render") else ["--no-render"]
    return shlex.join([*words, "-o", "again"])


def _of_candidates(settings: Mapping[str, Any]) -> Iterator[str]:
    candidates = dict(settings["candidates"])
    if "tilts_deg" in candidates:
        candidates["tilts"] = candidates.pop("tilts_deg")
    yield from _options(CandidateSettings, candidates)


def _of_objective(objective: Objective) -> Iterator[str]:
    values = {name: getattr(objective, name) for name in settings_of(Objective)}
    if values["central_weight"] == "scene":
        del values["central_weight"]
        yield "--weighted"
    yield from _options(Objective, values)
    scenarios = objective.scenarios
    if scenarios.errs:
        yield "--pose-errors"
        if scenarios.pose_errors != PoseErrors():
            for name, value in as_json(scenarios.pose_errors).items():
                yield from (f"--{name.removesuffix('_deg')}-error", f"{value:.12g}")
        yield from _options(Scenarios, {name: getattr(scenarios, name) for name in settings_of(Scenarios)})


def _of_survey(settings: Mapping[str, Any]) -> Iterator[str]:
    if settings.get("grid_spacing_m", DEFAULT_GRID) != DEFAULT_GRID:
        yield from ("--grid", f"{settings['grid_spacing_m']:.12g}")
    for name in ("engine", "solver"):
        if settings.get(name, "auto") != "auto":
            yield from (f"--{name}", str(settings[name]))
    if "time_limit_s" in settings:
        yield from ("--time-limit", f"{settings['time_limit_s']:.12g}")
    if settings.get("effort", DEFAULT_EFFORT) != DEFAULT_EFFORT:
        yield from ("--effort", f"{settings['effort']:.12g}")
    for name in ("catalogue", "reflectivity"):
        if settings.get(name):
            yield from (f"--{name}", *map(str, settings[name]))
    weather = settings.get("weather", {})
    words = [f"{name}={weather[name]:.12g}" for name in ("rain", "visibility") if weather.get(name)]
    words += ["wet"] if weather.get("wet_road") else []
    if words:
        yield from ("--weather", *words)
    cost = settings.get("installed_cost")
    if cost:
        shipped = cost == asdict(load_installed_cost())
        yield from ("--installed-cost", *([] if shipped else ["costs.toml"]))


def _options(kind: type, values: Mapping[str, Any]) -> Iterator[str]:
    """Yield the options that set what differs from the defaults of a settings class."""
    for name, (about, default) in settings_of(kind).items():
        value = values.get(name, default)
        given = list(value) if isinstance(value, list | tuple) else value
        if given == (list(default) if isinstance(default, tuple) else default):
            continue
        yield f"--{about.option or name.replace('_', '-')}"
        if not isinstance(given, bool):
            yield from (_typed(one) for one in (given if isinstance(given, list) else [given]))


def _typed(value: object) -> str:
    return f"{value:.12g}" if isinstance(value, float) else str(value)
