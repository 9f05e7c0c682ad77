"""Tasks of a network at one site: its survey, searches, and the files of the placement that is taken there.

Workers do them in the folder of the site, which they share with the command.
"""

from __future__ import annotations

import threading
from collections.abc import Generator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from headless.process_end import end_without_freeing

import bpy

from seip_addon.core.base.progress import Progress, finish
from seip_addon.core.choosing.network.frontier import SolvedBudget
from seip_addon.core.choosing.network.site_problem import SiteProblem
from seip_addon.core.output.results.placement_record import Provenance
from seip_addon.core.output.results.versions import versions
from seip_addon.core.workflows.network_sites import NetworkPlace, divided
from seip_addon.core.workflows.network_survey import NetworkRequest, site_problem, taken_solution
from seip_addon.core.workflows.placing import with_context
from seip_addon.core.workflows.records import record_of
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
    problem = yield from site_problem(survey, request.objective, place)
    problem.save(folder / PROBLEM, {"key": key, "attribution": list(survey.geometry.attribution)})


def _place(folder: Path, request: NetworkRequest, taken: SolvedBudget) -> Generator[Progress, None, None]:
    from seip_addon.scene.result_folder import write_result_folder  # noqa: PLC0415 -- loads matplotlib, half a second

    open_blend(folder / SCENE)
    survey = yield from _surveyed(folder, request.settings)
    solution = yield from taken_solution(survey, replace(request.objective, budget=taken.price), taken)
    solution = yield from with_context(survey, solution)
    record = record_of(survey, solution, Provenance(datetime.now(UTC), {}, versions(blender=bpy.app.version_string)))
    yield from write_result_folder(folder, bpy.context.scene, survey, solution, record, render=False)


def _surveyed(folder: Path, settings: SurveySettings) -> Generator[Progress, None, Survey]:
    reading = read_scene(bpy.context.scene)
    layout = lay_out(reading.geometry, settings, reading.warnings)
    return (yield from see(layout, folder / VISIBILITY, threads=1))


if threading.current_thread() is not threading.main_thread():
    end_without_freeing(0, Path(bpy.app.tempdir))  # a worker: Blender that a thread has loaded cannot be freed
