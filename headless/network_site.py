"""Survey sites of a network, or write the placements that are taken there, in a process of its own.

`headless.network_tasks` starts it and writes a folder on each line of its standard input; the folder holds the request
and receives the files.
"""

import pickle
import sys
import threading
from collections.abc import Generator
from datetime import UTC, datetime
from pathlib import Path
from queue import SimpleQueue

from headless import runtime
from headless.network_tasks import DONE, FORMAT, MEMORY, PLACED_FILES, REQUEST, SURVEY_FILES, PlaceJob, SurveyJob
from headless.process_end import end_now

import bpy

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Progress, finish
from seip_addon.core.output.results.placement_record import Provenance
from seip_addon.core.output.results.versions import versions
from seip_addon.core.workflows.network_sites import divided
from seip_addon.core.workflows.network_survey import site_problem, taken_solution
from seip_addon.core.workflows.placing import with_context
from seip_addon.core.workflows.records import record_of
from seip_addon.core.workflows.site_building import SiteRequest, build_site, save_map
from seip_addon.core.workflows.survey import Survey, lay_out, see
from seip_addon.core.workflows.survey_settings import SurveySettings
from seip_addon.scene.blend_file import new_file, open_blend, save_blend
from seip_addon.scene.build import build_scene
from seip_addon.scene.read import read_scene

SCENE, VISIBILITY, PROBLEM = SURVEY_FILES[0], SURVEY_FILES[1], SURVEY_FILES[3]


def main(_: list[str]) -> None:
    """Do what the requests in folders ask for, until one fails."""
    if sys.platform != "win32":
        import resource  # noqa: PLC0415 -- not on Windows

        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    lines: SimpleQueue[str] = SimpleQueue()
    threading.Thread(target=_read, args=(lines,), daemon=True).start()
    while True:
        folder = Path(lines.get().rstrip("\n"))
        job: SurveyJob | PlaceJob = pickle.loads((folder / REQUEST).read_bytes())  # noqa: S301 -- written by the caller
        try:
            finish(_survey(folder, job) if isinstance(job, SurveyJob) else _place(folder, job))
        except MemoryError as error:
            raise SeipError(
                f"the site needs more than {MEMORY / 2**30:.0f} GiB: shorten the approaches by --approaches"
            ) from error
        runtime.print_line(DONE)


def _read(lines: SimpleQueue[str]) -> None:
    """Read requests; end the process when the worker that writes them ends, even in the midst of one."""
    for line in sys.stdin:
        lines.put(line)
    end_now(0)


def _survey(folder: Path, job: SurveyJob) -> Generator[Progress, None, None]:
    source = folder / job.file
    if job.suffix == ".blend":
        open_blend(source)
    else:
        request = SiteRequest(near_latlon=(job.place.latitude, job.place.longitude), approaches=job.approaches)
        built = yield from build_site(source, request)
        scene = new_file()
        yield from build_scene(scene, divided(built.model, job.place), built.map_name)
        save_map(built, folder / "site.net.xml")
    save_blend(folder / SCENE)
    survey = yield from _surveyed(folder, job.settings)
    problem = yield from site_problem(survey, job.objective, job.place)
    site = survey.site
    header = {
        "key": job.key,
        "format": FORMAT,
        "name": job.place.name,
        "targets": len(site.targets),
        "positions": len(site.candidates.position),
        "warnings": list(survey.warnings),
        "attribution": list(survey.geometry.attribution),
    }
    problem.save(folder / PROBLEM, header)


def _place(folder: Path, job: PlaceJob) -> Generator[Progress, None, None]:
    from seip_addon.scene.result_folder import write_result_folder  # noqa: PLC0415 -- loads matplotlib, half a second

    open_blend(folder / SCENE)
    survey = yield from _surveyed(folder, job.settings)
    solution = yield from taken_solution(survey, job.objective, job.taken)
    solution = yield from with_context(survey, solution)
    now = Provenance(datetime.now(UTC), {}, versions(blender=bpy.app.version_string))
    placed = folder / PLACED_FILES
    placed.mkdir()
    record = record_of(survey, solution, now)
    yield from write_result_folder(placed, bpy.context.scene, survey, solution, record, render=False)


def _surveyed(folder: Path, settings: SurveySettings) -> Generator[Progress, None, Survey]:
    reading = read_scene(bpy.context.scene)
    layout = lay_out(reading.geometry, settings, reading.warnings)
    return (yield from see(layout, folder / VISIBILITY, threads=1))


if __name__ == "__main__":
    runtime.run(main)
