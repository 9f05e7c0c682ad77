"""Options and steps that commands share: scene options, site layout and visibility grid."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeVar

from headless import runtime
from headless.options import add_settings, add_weather, read_settings

import bpy
import numpy as np

from seip_addon.core.base.counts import counted
from seip_addon.core.base.progress import Progress
from seip_addon.core.base.settings import settings_of
from seip_addon.core.choosing.placement.deployment import Sensor
from seip_addon.core.choosing.placement.objective import Objective, Solution
from seip_addon.core.output.results.placement_record import Provenance
from seip_addon.core.output.results.versions import versions
from seip_addon.core.sensing.weather import weather_of
from seip_addon.core.site.candidates import CandidateSettings
from seip_addon.core.site.installed_cost import DEFAULTS, load_installed_cost
from seip_addon.core.site.site import Site
from seip_addon.core.storage.folder_contents import check_no_run
from seip_addon.core.workflows.early_answer import early_answer
from seip_addon.core.workflows.records import record_of
from seip_addon.core.workflows.survey import Layout, Survey, lay_out, see
from seip_addon.core.workflows.survey_settings import SurveySettings
from seip_addon.core.workflows.traffic_runs import runs_in, traffic_folder
from seip_addon.scene.read import read_scene
from seip_addon.scene.result_folder import write_result_folder

Result = TypeVar("Result")


@dataclass
class Stopwatch:
    """Seconds of each step; kept apart from results."""

    seconds: dict[str, float] = field(default_factory=dict)

    def time(self, step: str, work: Callable[[], Result]) -> Result:
        """Return what ``work`` returns and note how long it took."""
        start = time.perf_counter()
        result = work()
        self.seconds[step] = time.perf_counter() - start
        return result

    def run(self, step: str, steps: Generator[Progress, None, Result]) -> Result:
        """Run work in steps to its end behind a progress bar."""
        return self.time(step, lambda: runtime.finish_with_bar(steps))


def add_options(parser: argparse.ArgumentParser) -> tuple[argparse._ArgumentGroup, ...]:
    """Add the scene, the folder of results and the options of a survey to a command; return the groups of options."""
    parser.add_argument("scene", nargs="?", type=Path, help="the .blend; in Blender the open scene")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the results")
    groups = add_survey_settings(parser)
    work = parser.add_argument_group("work")
    add_settings(work, SurveySettings, "solver", "effort")
    return (*groups, work)


def add_survey_settings(parser: argparse.ArgumentParser) -> tuple[argparse._ArgumentGroup, ...]:
    """Add what a survey depends on to a command: sensors, grid, candidates and weather; return their groups."""
    sensors = parser.add_argument_group("sensors")
    add_settings(sensors, CandidateSettings, "sensors")
    add_settings(sensors, SurveySettings, "catalogue")
    add_settings(sensors, CandidateSettings, "heights", "tilts")
    installed, _ = settings_of(SurveySettings)["installed_cost"]
    sensors.add_argument(
        "--installed-cost",
        nargs="?",
        const=DEFAULTS,
        type=Path,
        metavar=installed.metavar,
        help=installed.help,
    )
    metres = parser.add_argument_group("site: grid and candidates in metres, and weather")
    add_settings(metres, SurveySettings, "grid_spacing")
    add_settings(metres, CandidateSettings, "spacing", "allow")
    add_weather(metres)
    return sensors, metres


def runs_beside(scene: Path | None, kind: str = "") -> list[Path]:
    """Return the runs in the `traffic_folder` of a scene, or of the one that is open."""
    return runs_in(traffic_folder(scene_path(scene), kind))


def scene_path(scene: Path | None) -> Path:
    """Return the file of a scene, or of the one that is open."""
    return Path(bpy.data.filepath) if scene is None else scene


def survey(
    options: argparse.Namespace, check: Callable[[Layout], None], objective: Objective | None = None
) -> tuple[Survey, Stopwatch]:
    """Survey a scene: read it, lay out its site, and find or compute its visibility grid.

    Parameters
    ----------
    options : Namespace
        Options of a parser with `add_options`.
    check : callable
        Called before any ray is cast: refuses what cannot be had on the layout.
    objective : Objective, optional
        Objective of the placement that follows, for an early answer.

    Returns
    -------
    Survey, Stopwatch
        The survey, and the seconds of each of its steps.

    Raises
    ------
    SeipError
        A sensor type is unknown, the folder cannot be written or holds a run, the scene cannot be read, or ``check``
        refuses its layout.
    """
    settings = read_survey_settings(options)
    settings.models()  # refuses unknown types before the scene is read
    runtime.check_folder(options.output)
    check_no_run(options.output)
    runtime.open_scene(options.scene)

    watch = Stopwatch()
    reading = watch.time("read the scene", lambda: read_scene(bpy.context.scene))
    layout = watch.time("lay out the site", lambda: lay_out(reading.geometry, settings, reading.warnings))
    runtime.LOG.info(_describe_site(layout.site))
    runtime.warn(layout.warnings)
    check(layout)
    file = options.output / "visibility.npz"
    if objective is not None:
        early = watch.run("early answer", early_answer(layout, objective, file))
        if early.best:
            runtime.LOG.info("early answer from a few poses: %s", early.best)
    surveyed = watch.run("visibility", see(layout, file))
    return surveyed, watch


def save_solution(surveyed: Survey, watch: Stopwatch, solution: Solution, folder: Path, *, render: bool) -> None:
    """Write a solution of a survey, with its record, to the folder of results."""
    now = Provenance(datetime.now(UTC), watch.seconds, versions(blender=bpy.app.version_string))
    record = record_of(surveyed, solution, now, render=render)
    steps = write_result_folder(folder, bpy.context.scene, surveyed, solution, record, render=render)
    runtime.finish_with_bar(steps)


def describe_sensor(sensor: Sensor) -> str:
    """Describe a sensor: type, position, height and how it is turned."""
    return f"{sensor.label}  {sensor.model.key} at {sensor.height:g} m{sensor.turned}, {sensor.position_name}"


def read_survey_settings(options: argparse.Namespace) -> SurveySettings:
    """Return the settings of a survey that options name."""
    candidates = read_settings(CandidateSettings, options)
    return read_settings(
        SurveySettings,
        options,
        candidates=candidates,
        weather=weather_of(options.weather),
        installed_cost=None if options.installed_cost is None else load_installed_cost(options.installed_cost),
    )


def _describe_site(site: Site) -> str:
    candidates = site.candidates
    dropped = ", ".join(f"{count} {reason}" for reason, count in candidates.dropped.items())
    poles = np.count_nonzero(candidates.on_pole)
    return (
        f"{site.name}: {counted(len(site.targets), 'target')}, {counted(len(candidates.position), 'position')} "
        f"({poles} on poles), {counted(len(candidates), 'pose')}, {counted(len(site.triangles), 'triangle')}"
        + (f"; dropped: {dropped}" if dropped else "")
    )
