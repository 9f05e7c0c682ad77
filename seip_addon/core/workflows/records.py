"""Records of placements: from a solution to the content of ``placement.json``, and back."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

import numpy as np

from ..base.errors import SeipError
from ..base.progress import Progress
from ..choosing.placement.deployment import pose_prices
from ..choosing.placement.objective import MOVED, Solution
from ..output.results.geographic_files import LOCATED_FILES, missing_sentence
from ..output.results.placement_record import PlacementRecord, Provenance, placement_record
from ..sensing.lidar.catalogue import find_models, load_catalogue
from ..sensing.returns.returns_grid import returns_key
from ..sensing.returns.road_users import road_users
from ..sensing.visibility.ray_casting import engine_name
from ..site.locations import locations
from ..storage.files import digest
from ..storage.json_dataclass import as_json
from .moved_sensors import evaluate_moved_sensors
from .returns import CROSSING_SHARE, stored_pedestrian_returns
from .survey import Layout, Survey, grid_key

STALE = "the placement is stale, as the scene or its settings have changed: place again"
_RETURNS = "returns"
"""Name of the digest of inputs that only a placement by returns has."""


def inputs_of(layout: Layout) -> dict[str, str]:
    """Return digests of the inputs of a placement: the visibility grid, the rest of the site, and the returns.

    Two layouts with the same digests have the same solution for the same objective. For criteria other than returns,
    the digests of the visibility grid and of the site are sufficient.
    """
    targets, candidates = layout.site.targets, layout.site.candidates
    site = digest(
        *(targets.weight, targets.central, candidates.position_name, candidates.position_of),
        *(candidates.mandatory, candidates.mandatory_name, pose_prices(candidates, layout.models)),
    )
    users = road_users(layout.geometry)
    returns = digest(
        returns_key(layout.site, users, layout.models, engine_name(layout.settings.engine)),
        *(users.weight, users.central, users.crossing),
        *users.crossings,
        CROSSING_SHARE,
    )
    return {"visibility": grid_key(layout), "site": site, _RETURNS: returns}


def record_of(survey: Survey, solution: Solution, provenance: Provenance, *, render: bool = False) -> PlacementRecord:
    """Return the contents of ``placement.json`` for a solution.

    Parameters
    ----------
    render : bool
        Whether the result includes a rendered view.
    """
    objective = {"goal": as_json(solution.objective), "render": render}
    missing = missing_sentence(survey.site, LOCATED_FILES)
    notes = (*solution.notes, *([missing] if missing else []))
    inputs = inputs_of(survey)
    if solution.deployment.returns is None:
        del inputs[_RETURNS]
    record = placement_record(
        survey.site,
        replace(solution, placement=replace(solution.placement, notes=notes)),
        provenance,
        settings={**survey.settings.as_record(), **objective},
        inputs=inputs,
        warnings=survey.warnings,
    )
    feet = np.array([sensor.foot[:2] for sensor in solution.deployment.sensors]).reshape(-1, 2)
    named = zip(record.sensors, locations(survey.geometry, feet), strict=True)
    return replace(record, sensors=tuple(replace(sensor, location=words) for sensor, words in named))


def restored_solution(survey: Survey, record: PlacementRecord) -> Generator[Progress, None, Solution]:
    """Return the solution in a record of `record_of`, without solving again.

    Sensors that were moved by hand are evaluated at their poses.

    Parameters
    ----------
    survey : Survey
        Survey of the record.
    record : PlacementRecord
        Record of the solution. A greedy placement in it is left out.

    Raises
    ------
    SeipError
        The record belongs to a different survey, or contains a pose that is not a candidate.
    """
    if record.inputs.get("visibility") != survey.grid.key or not record.is_of(inputs_of(survey)):
        raise SeipError(STALE)
    if record.objective.status == MOVED:
        return (yield from _restored_by_hand(survey, record))
    poses = range(len(survey.site.candidates))
    if not all(sensor.pose in poses for sensor in record.sensors):
        raise SeipError(STALE)
    objective, chosen = record.request.goal, record.poses
    known = replace(survey.deploy(chosen), gain_band=record.coverage.gain_band, returns=record.returns)
    if record.returns is not None:
        known = replace(known, pedestrian_returns=stored_pedestrian_returns(survey, chosen))
    solution = Solution(objective, record.placement, None, known, judgement=record.judgement)
    return replace(solution, front=record.front, crossings=record.crossings)


def _restored_by_hand(survey: Survey, record: PlacementRecord) -> Generator[Progress, None, Solution]:
    """Evaluate the sensors of a record again, on the survey of the record."""
    sensors = record.sensors
    models = find_models(load_catalogue(survey.settings.catalogue), sorted({one.sensor for one in sensors}))
    mounted = [one.mounted(models[one.sensor]) for one in sensors]
    places = {one.id: one.position for one in sensors}
    return (yield from evaluate_moved_sensors(survey, record.request.goal, mounted, places))
