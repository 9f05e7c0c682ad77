"""Find where each method begins to fail, and write the stability page with its charts.

seip study stability scenes/junction.blend -o docs
seip study stability scenes/junction.blend -o docs --only weather
blender -b --python-exit-code 1 site.blend -P headless/study.py -- stability -o docs

Finished chapters are stored in the work folder: rerun the command to resume.
"""

import argparse
from pathlib import Path

from headless import runtime, survey
from headless.options import new_parser
from headless.studies.stability.chapters import CHAPTERS, StabilityScope, StudiedScene, chapters, introduction
from headless.studies.stability.page import load_chapter, put_chapter, save_chapter, save_page
from headless.studies.survey_options import add_survey_options

from seip_addon.core.choosing.placement.objective import DEFAULT_COUNT, Objective, check_objective
from seip_addon.core.errors import SeipError
from seip_addon.core.sensing.traffic.trajectories import Trajectories
from seip_addon.core.storage.files import digest
from seip_addon.core.storage.source_digest import source_digest
from seip_addon.core.workflows.survey import grid_key

PAGE, CHARTS = "stability.md", "stability"


def main(argv: list[str], scope: StabilityScope | None = None) -> None:
    """Study the chapters that are not finished, and write the page; tests pass a small ``scope``."""
    options = _parser().parse_args(argv)
    charts = options.output / CHARTS
    if options.only and not (options.output / PAGE).is_file():
        raise SeipError(f"there is no page {options.output / PAGE} to add chapters to: leave out --only")
    runtime.check_folder(charts)
    surveyed, watch = survey.survey(
        argparse.Namespace(**vars(options) | {"output": options.work}),
        lambda layout: check_objective(layout.site, layout.models, Objective(count=DEFAULT_COUNT)),
    )
    origin = surveyed.geometry.origin
    runs = [Trajectories.load(path).moved_to(origin) for path in survey.runs_beside(options.scene)]
    scene = StudiedScene(surveyed, runs, charts, scope or StabilityScope())
    made_from = digest(
        grid_key(surveyed),
        repr(surveyed.settings),
        repr(scene.scope),
        *(run.key for run in runs),
        source_digest("headless.studies.stability.command"),
    )
    done = []
    requested = [(name, work) for name, work in chapters(scene) if name in (options.only or [name])]
    for name, work in requested:
        chapter = load_chapter(options.work / f"{name}.json", made_from)
        if chapter is None or not all((charts / chart.file).exists() for chart in chapter.charts):
            chapter = watch.run(name, work(scene))
            save_chapter(options.work / f"{name}.json", chapter, made_from)
            runtime.LOG.info(f"{chapter.title}: {len(chapter.rows)} rows, {watch.seconds[name]:.0f} s")
        done.append(chapter)
    with runtime.incomplete_if_interrupted(options.output):
        if options.only:
            for chapter in done:
                put_chapter(options.output / PAGE, chapter, CHARTS)
        else:
            save_page(options.output / PAGE, introduction(scene), done, CHARTS)
    runtime.print_line(f"written to {options.output / PAGE}")


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("study stability", "Find the limits of every method, and write a page with charts.")
    add_survey_options(parser)
    parser.add_argument(
        "--only",
        nargs="+",
        choices=CHAPTERS,
        metavar="CHAPTER",
        help=f"update only these chapters: {', '.join(CHAPTERS)}",
    )
    parser.add_argument(
        "--work", type=Path, default=Path("out/stability"), help="folder for finished work, from which a rerun resumes"
    )
    return parser
