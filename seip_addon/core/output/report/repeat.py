"""The command that repeats a placement, from what its record holds."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator
from dataclasses import fields

from ...base.settings import settings_of
from ...choosing.placement.objective import Objective
from ...sensing.scenarios.pose_errors import PoseErrors
from ...sensing.visibility.settings import VisibilitySettings
from ...site.candidates import CandidateSettings
from ...site.installed_cost import load_installed_cost
from ...storage.json_dataclass import as_json
from ..results.placement_record import PlacementRecord, RecordedSettings


def repeating_command(record: PlacementRecord) -> str:
    """Return the command that repeats a placement in the folder of its result, or "" if no single command does."""
    settings = record.request
    if record.objective.solver == "none" or settings.goal.scenarios.kind == "traffic":
        return ""  # moved by hand, or optimised on runs of traffic that the record does not name
    scenarios, errors, candidates = settings.goal.scenarios, settings.goal.scenarios.pose_errors, settings.candidates
    named = settings_of(CandidateSettings)
    only_in_python = (
        settings.engine != "auto",
        settings.visibility != VisibilitySettings(),
        any(getattr(candidates, one.name) != one.default for one in fields(CandidateSettings) if one.name not in named),
        scenarios.count is not None,
        scenarios.held_out is not None,
        (errors.height, errors.yaw) != (errors.position, errors.tilt),
    )
    if any(only_in_python):
        return ""
    words = ["seip", "place", "placed.blend", *_options(candidates), *_of_survey(settings)]
    words += [*_of_objective(settings.goal), *([] if settings.render else ["--no-render"])]
    return shlex.join([*words, "-o", "again"])


def _of_objective(objective: Objective) -> Iterator[str]:
    if objective.central_weight is not None:
        yield from ("--weighted", *([] if objective.central_weight == "scene" else [_typed(objective.central_weight)]))
    if objective.mandatory:
        yield from ("--require", *objective.mandatory)
    yield from _options(objective)
    scenarios = objective.scenarios
    if scenarios.errs:
        errors = as_json(scenarios.pose_errors)
        usual = scenarios.pose_errors == PoseErrors()
        yield from ("--pose-errors", *([] if usual else [_typed(errors[name]) for name in ("position", "tilt_deg")]))
        yield from _options(scenarios)


def _of_survey(settings: RecordedSettings) -> Iterator[str]:
    default = RecordedSettings(settings.goal, settings.candidates)
    for option, name in (("grid", "grid_spacing_m"), ("solver", "solver"), ("effort", "effort")):
        value = getattr(settings, name)
        if value != getattr(default, name):
            yield from (f"--{option}", _typed(value))
    if settings.catalogue:
        yield from ("--catalogue", *settings.catalogue)
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
            for one in value if isinstance(value, tuple) else (value,):
                yield _typed(math.degrees(one) if about.unit == "rad" and isinstance(one, float) else one)


def _typed(value: object) -> str:
    return f"{value:.12g}" if isinstance(value, float) else str(value)
