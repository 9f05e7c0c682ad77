"""Records of placements: what ``placement.json`` holds of a solution, and the solution of a record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..choosing.placement.deployment import deploy_rows
from ..choosing.placement.objective import Solution, target_weights
from ..errors import SeipError
from ..output.results.located import LOCATED_FILES, missing_sentence
from ..output.results.placement_record import PlacementRecord, Provenance, placement_record
from ..site.locations import locations
from ..storage.json_dataclass import as_json
from .returns import stored_pedestrian_returns
from .survey import Survey, inputs_of


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
    record = placement_record(
        survey.site,
        replace(solution, placement=replace(solution.placement, notes=notes)),
        provenance,
        settings={**survey.settings.as_record(), **objective},
        inputs=inputs_of(survey) | {"visibility": survey.grid.key},
        warnings=survey.warnings,
    )
    feet = np.array([sensor.foot[:2] for sensor in solution.deployment.sensors]).reshape(-1, 2)
    named = zip(record.sensors, locations(survey.geometry, feet), strict=True)
    return replace(record, sensors=tuple(replace(sensor, location=words) for sensor, words in named))


def restored_solution(survey: Survey, record: PlacementRecord) -> Solution:
    """Return the solution in a record of `record_of`, without solving again.

    Parameters
    ----------
    survey : Survey
        Survey of the record.
    record : PlacementRecord
        Record of the solution. A greedy placement in it is left out.

    Raises
    ------
    SeipError
        The record belongs to a different grid, or contains a pose that is not a candidate.
    """
    site, grid = survey.site, survey.grid
    poses = range(len(site.candidates))
    if record.inputs.get("visibility") != grid.key or not all(sensor.pose in poses for sensor in record.sensors):
        raise SeipError("the placement is stale, as the scene or its settings have changed: place again")
    objective, chosen = record.request.goal, record.poses
    covered = float(target_weights(site, objective)[grid.times_seen(chosen) > 0].sum())
    deployment = deploy_rows(site, survey.models, grid.rows(chosen), chosen)
    known = replace(deployment, gain_band=record.coverage.gain_band, returns=record.returns)
    if record.returns is not None:
        known = replace(known, pedestrian_returns=stored_pedestrian_returns(survey, chosen))
    return Solution(objective, record.placement(covered), None, known, front=record.front, crossings=record.crossings)
