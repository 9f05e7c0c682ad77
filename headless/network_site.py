"""Tasks of a network at one site: its survey, searches, and the files of the placement that is taken there.

Workers do them in the folder of the site, which they share with the command.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Generator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from headless.process_end import end_without_freeing

import bpy
import numpy as np

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Progress, finish
from seip_addon.core.choosing.network.frontier import SolvedBudget
from seip_addon.core.choosing.network.site_problem import SiteProblem, check_problem
from seip_addon.core.choosing.placement.concave import relative_gap
from seip_addon.core.choosing.placement.deployment import deploy, pose_prices
from seip_addon.core.choosing.placement.objective import Objective, Solution, criterion_of, placement_constraints
from seip_addon.core.choosing.placement.problem import Placement
from seip_addon.core.output.results.placement_record import Provenance
from seip_addon.core.output.results.versions import versions
from seip_addon.core.workflows.network_sites import NetworkPlace, NetworkRequest, divided
from seip_addon.core.workflows.placing import with_context
from seip_addon.core.workflows.records import record_of
from seip_addon.core.workflows.returns import survey_returns
from seip_addon.core.workflows.site_building import SiteRequest, build_site, save_map
from seip_addon.core.workflows.survey import Survey, lay_out, see
from seip_addon.core.workflows.survey_settings import SurveySettings
from seip_addon.scene.blend_file import new_file, open_blend, save_blend
from seip_addon.scene.build import build_scene
from seip_addon.scene.read import read_scene

SCENE, PROBLEM = "site.blend", "problem.npz"
VISIBILITY = "visibility.npz"
SURVEY_FILES = (SCENE, VISIBILITY, "visibility.returns.npz", PROBLEM, "site.net.xml")
"""Files of the survey of a site, which need not have all of them."""

_BLENDER = threading.Lock()
"""Blender has one scene, which the threads of a worker must not share."""


def survey_site(folder: Path, source: Path, place: NetworkPlace, request: NetworkRequest, key: str) -> None:
    """Build and survey a site, and write the files of its survey; the problem comes last.

    Parameters
    ----------
    source : path
        File that the site is built from.
    key : str
        Digest of everything that the result depends on, for the header of the problem.

    Raises
    ------
    SeipError
        The site cannot be built, or no sensor can be placed there.
    """
    with _BLENDER:
        finish(_survey(folder, source, place, request, key))


def solve_budget(folder: Path, budget: float, effort: float) -> SolvedBudget:
    """Return the best placement at a site within a budget."""
    problem, _ = SiteProblem.load(folder / PROBLEM)
    return finish(problem.solve(budget, effort))


def write_placement(folder: Path, request: NetworkRequest, taken: SolvedBudget) -> None:
    """Write the files of the placement that is taken at a site, as `seip place` does."""
    with _BLENDER:
        finish(_place(folder, request, taken))


def _survey(
    folder: Path, source: Path, place: NetworkPlace, request: NetworkRequest, key: str
) -> Generator[Progress, None, None]:
    if source.suffix == ".blend":
        open_blend(source)
    else:
        asked = SiteRequest(near_latlon=(place.latitude, place.longitude), approaches=request.approaches)
        built = yield from build_site(source, asked)
        scene = new_file()
        yield from build_scene(scene, divided(built.model, place), built.map_name)
        save_map(built, folder / "site.net.xml")
    save_blend(folder / SCENE)
    survey = yield from _surveyed(folder, request.settings)
    problem = yield from _site_problem(survey, request.objective, place)
    problem.save(folder / PROBLEM, {"key": key, "attribution": list(survey.geometry.attribution)})


def _place(folder: Path, request: NetworkRequest, taken: SolvedBudget) -> Generator[Progress, None, None]:
    from seip_addon.scene.result_folder import write_result_folder  # noqa: PLC0415 -- loads matplotlib, half a second

    open_blend(folder / SCENE)
    survey = yield from _surveyed(folder, request.settings)
    solution = yield from _taken_solution(survey, replace(request.objective, budget=taken.price), taken)
    solution = yield from with_context(survey, solution)
    record = record_of(survey, solution, Provenance(datetime.now(UTC), {}, versions(blender=bpy.app.version_string)))
    yield from write_result_folder(folder, bpy.context.scene, survey, solution, record, render=False)


def _surveyed(folder: Path, settings: SurveySettings) -> Generator[Progress, None, Survey]:
    reading = read_scene(bpy.context.scene)
    layout = lay_out(reading.geometry, settings, reading.warnings)
    return (yield from see(layout, folder / VISIBILITY, threads=1))


def _site_problem(survey: Survey, objective: Objective, place: NetworkPlace) -> Generator[Progress, None, SiteProblem]:
    """Return the placement problem of a site of a network.

    Parameters
    ----------
    objective : Objective
        Criterion, and the largest number of sensors at the site.

    Raises
    ------
    SeipError
        The site demands a sensor somewhere, or no candidate sees anything.
    """
    site, candidates = survey.site, survey.site.candidates
    constraints = placement_constraints(site, survey.models, _at_site(survey, objective))
    if len(constraints.mandatory_groups):
        raise SeipError(
            f"{constraints.group_names[0]} must carry a sensor, which is not possible in a network: clear the "
            "mandatory poles and areas of the site"
        )
    allowed = constraints.allowed[:, None]  # forbidden poses keep their indices, and have no value
    criterion = criterion_of(objective, survey.models)
    returns, weights = np.zeros((len(candidates), 0), dtype=np.float32), np.zeros(0)
    if criterion == "returns":
        found = yield from survey_returns(survey, objective, threads=1)
        returns, weights = found.in_traffic(), found.weights
    geographic = site.geographic(candidates.xyz)
    if geographic is None:  # a scene without a projection lies where the table says
        latlon = np.tile((place.latitude, place.longitude), (len(candidates), 1))
    else:
        latlon = geographic[:, 1::-1]
    problem = SiteProblem(
        criterion="returns" if criterion == "returns" else "road",
        visible=survey.grid.visible & allowed,
        returns=np.where(allowed, returns, np.float32(0.0)),
        user_weights=weights,
        prices=pose_prices(candidates, survey.models),
        positions=candidates.position_of,
        xyz=candidates.xyz,
        heights=candidates.height,
        latlon=np.round(latlon, 8),
        labels=candidates.sensor,
        names=candidates.position_name[candidates.position_of],
        most_sensors=_at_site(survey, objective).count or len(candidates.position),
    )
    check_problem(problem)
    return problem


def _taken_solution(survey: Survey, objective: Objective, taken: SolvedBudget) -> Generator[Progress, None, Solution]:
    """Return the solution of the placement that an allocation takes at a site, as `place` returns it."""
    objective = _at_site(survey, objective)
    chosen = np.array(taken.chosen, dtype=np.int64)
    optimal = taken.bound <= taken.value
    rows = survey.grid.rows(chosen)
    covered = float(rows.any(axis=0).sum())
    of_returns = criterion_of(objective, survey.models) == "returns"
    value, bound = (taken.value, taken.bound) if of_returns else (covered, taken.bound * rows.shape[1])
    placement = Placement(
        chosen=chosen,
        objective=value,
        bound=value if optimal else bound,
        gap=0.0 if optimal else math.expm1(bound - value) if of_returns else relative_gap(value, bound),
        status="optimal" if optimal else "feasible",
        solver="network allocation",
        price=taken.price,
        notes=("the money at this site is its share of the budget of a network",),
    )
    if of_returns:
        return (yield from survey_returns(survey, objective, threads=1)).solution(survey, placement, None)
    return Solution(objective, placement, None, deploy(survey.site, survey.models, rows, chosen))


def _at_site(survey: Survey, objective: Objective) -> Objective:
    """Return the objective with no more sensors than the site has positions."""
    positions = len(survey.site.candidates.position)
    return replace(objective, count=min(objective.count or positions, positions))


if threading.current_thread() is not threading.main_thread():
    end_without_freeing(0, Path(bpy.app.tempdir))  # a worker: Blender that a thread has loaded cannot be freed
