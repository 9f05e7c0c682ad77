"""Options and steps that commands share: scene options, site layout and visibility grid."""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeVar

from headless import session

import bpy
import numpy as np

from seip_addon.core.errors import SeipError
from seip_addon.core.geometry.orientation import tilt_in_words
from seip_addon.core.lidar import LidarModel
from seip_addon.core.placement.deployment import Sensor
from seip_addon.core.placement.objective import Solution
from seip_addon.core.progress import Progress, finish
from seip_addon.core.results.placement_record import versions
from seip_addon.core.site.candidates import CandidateSettings, heights_of, tilts_of
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.site.site import Site
from seip_addon.core.visibility.grid import VisibilityGrid, VisibilitySettings
from seip_addon.core.visibility.needed_triangles import triangles_sentence
from seip_addon.core.workflows.convergence import Convergence
from seip_addon.core.workflows.survey import Circumstances, Layout, SurveySettings, lay_out, record_of, see
from seip_addon.scene.read import read_scene
from seip_addon.scene.result_folder import write_result_folder

Result = TypeVar("Result")


@dataclass
class Stopwatch:
    """How long each step took, in seconds; kept apart from results."""

    seconds: dict[str, float] = field(default_factory=dict)

    def time(self, step: str, work: Callable[[], Result]) -> Result:
        """Return what ``work`` returns and note how long it took."""
        start = time.perf_counter()
        result = work()
        self.seconds[step] = time.perf_counter() - start
        return result

    def run(self, step: str, steps: Generator[Progress, None, Result]) -> Result:
        """Run work in steps to its end behind a progress bar."""
        with session.progress_bar() as report:
            return self.time(step, lambda: finish(steps, report))


@dataclass(frozen=True, eq=False)
class Survey:
    """A scene laid out and seen."""

    layout: Layout
    grid: VisibilityGrid
    stopwatch: Stopwatch


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the scene, the folder of results and the options of a survey to a command."""
    layout, sight = CandidateSettings(), VisibilitySettings()
    parser.add_argument("scene", nargs="?", type=Path, help="the .blend; in Blender the open scene")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the results")
    sensors = parser.add_argument_group("sensors")
    sensors.add_argument("--sensor", nargs="+", default=layout.sensors, metavar="KEY", help="types to choose from")
    sensors.add_argument("--catalogue", nargs="+", type=Path, default=[], metavar="TOML", help="catalogues of your own")
    sensors.add_argument(
        "--heights",
        nargs="+",
        default=layout.heights,
        action=_several(heights_of),
        metavar="M",
        help="metres, or FROM:TO:STEP",
    )
    sensors.add_argument(
        "--tilts",
        nargs="+",
        default=layout.tilts,
        action=_several(tilts_of),
        metavar="DEG",
        help="degrees nose down towards the region, or FROM:TO:STEP; up where negative; upright if not given",
    )
    metres = parser.add_argument_group("grid and candidates, in metres")
    metres.add_argument("--grid", type=float, default=1.0, help="spacing of the targets")
    metres.add_argument("--delta", type=float, default=sight.delta, help="a return closer than this sees a target")
    metres.add_argument("--spacing", type=float, default=layout.spacing, help="between posts on the pavement")
    metres.add_argument("--setback", type=float, default=layout.setback, help="of posts from the kerb")
    metres.add_argument("--clearance", type=float, default=layout.clearance, help="of posts from walls")
    sensors.add_argument(
        "--assumed-poles",
        action="store_true",
        help="let poles carry sensors that are assumed, since the map has none for its traffic lights",
    )
    metres.add_argument("--bracket", type=float, default=layout.bracket, help="of sensors from the axis of a pole")
    work = parser.add_argument_group("work")
    work.add_argument(
        "--min-intensity", type=float, default=sight.min_intensity, help="least intensity of a return that sees"
    )
    work.add_argument("--engine", choices=("auto", "bvh", "embree"), default="auto", help="ray caster")
    work.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="Dask scheduler whose workers cast: tcp://host:8786, tls://host:8786",
    )
    work.add_argument(
        "--solver", default="auto", help="auto (HiGHS where it is installed, else CBC), highs, cbc or gurobi"
    )
    work.add_argument(
        "--time-limit", type=float, metavar="S", help="for each answer, in seconds (default: 60, or none with --effort)"
    )
    work.add_argument(
        "--effort",
        type=float,
        metavar="UNITS",
        default=math.inf,
        help="for each answer, in units of counted work, each about a second of one core: the same answer every time",
    )


Refine = Callable[[SceneGeometry, SurveySettings], Generator[Progress, None, Convergence]]


def survey(
    options: argparse.Namespace, check: Callable[[Site, dict[str, LidarModel]], None], refine: Refine | None = None
) -> Survey:
    """Read the scene, lay out its site, and find or compute its visibility grid.

    Parameters
    ----------
    options : Namespace
        Of a parser with `add_options`.
    check : callable
        Called with the site and the models before any ray is cast: refuses what the site cannot do.
    refine : callable, optional
        Finds the spacings of targets and candidates.

    Returns
    -------
    Survey
    """
    settings = _settings(options)
    settings.models()  # refuses unknown types before the scene is read
    session.check_folder(options.output)
    session.open_scene(options.scene)

    watch = Stopwatch()
    reading = watch.time("read the scene", lambda: read_scene(bpy.context.scene))
    if refine is not None:
        settings = watch.run("spacings", refine(reading.geometry, settings)).settings
        session.say(settings.spacings_because)
    layout = watch.time("lay out the site", lambda: lay_out(reading.geometry, settings, reading.warnings))
    session.say(_in_words(layout.site))
    for sentence in layout.warnings:
        session.say(f"warning: {sentence}")
    check(layout.site, layout.models)
    grid = watch.run("visibility", see(layout, options.output / "visibility.npz", options.scheduler))
    session.say(triangles_sentence(grid.parameters["triangles"]))
    return Survey(layout, grid, watch)


def save_plan(surveyed: Survey, plan: Solution, folder: Path, *, render: bool, pose_errors: bool = False) -> None:
    """Write a plan of a survey, with its record, to the folder of results."""
    layout, grid = surveyed.layout, surveyed.grid
    now = Circumstances(datetime.now(UTC), surveyed.stopwatch.seconds, versions(blender=bpy.app.version_string))
    write_result_folder(
        folder,
        bpy.context.scene,
        layout.geometry,
        layout.site,
        plan,
        record_of(layout, grid, plan, now, render=render, pose_errors=pose_errors),
        visible=grid.visible,
        models=layout.models,
        render=render,
    )


def sensor_in_words(sensor: Sensor) -> str:
    """Say which sensor hangs where."""
    tilt = tilt_in_words(sensor.tilt)
    return f"{sensor.label}  {sensor.model.key} at {sensor.height:g} m{tilt}, {sensor.position_name}"


def time_limit_of(options: argparse.Namespace) -> float:
    """Return the limit of time for each answer; where work is limited there is none unless it is asked for."""
    if options.time_limit is None:
        return math.inf if math.isfinite(options.effort) else SurveySettings().time_limit
    return float(options.time_limit)


def _settings(options: argparse.Namespace) -> SurveySettings:
    return SurveySettings(
        candidates=CandidateSettings(
            sensors=tuple(options.sensor),
            heights=tuple(options.heights),
            tilts=tuple(options.tilts),
            spacing=options.spacing,
            setback=options.setback,
            clearance=options.clearance,
            bracket=options.bracket,
            assumed_poles=options.assumed_poles,
        ),
        visibility=VisibilitySettings(options.delta, options.min_intensity),
        grid_spacing=options.grid,
        catalogue=tuple(options.catalogue),
        engine=options.engine,
        solver=options.solver,
        time_limit=time_limit_of(options),
        effort=options.effort,
    )


def _in_words(site: Site) -> str:
    candidates = site.candidates
    dropped = ", ".join(f"{count} {reason}" for reason, count in candidates.dropped.items())
    poles = np.count_nonzero(candidates.on_pole)
    return (
        f"{site.name}: {len(site.targets):,} targets, {len(candidates.position)} positions ({poles} on poles), "
        f"{len(candidates):,} poses, {len(site.triangles):,} triangles" + (f"; dropped: {dropped}" if dropped else "")
    )


class HelpWithDefaults(argparse.ArgumentDefaultsHelpFormatter):
    """Help that names the default of each option that has one."""

    def _get_help_string(self, action: argparse.Action) -> str | None:
        return action.help if action.default in (None, [], math.inf) else super()._get_help_string(action)


def _several(numbers_of: Callable[[list[str]], tuple[float, ...]]) -> type[argparse.Action]:
    """Return what stores the numbers that several texts name, each a number or a range."""

    class Several(argparse.Action):
        def __call__(
            self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: object, *_: object
        ) -> None:
            texts = values if isinstance(values, list) else []
            try:
                setattr(namespace, self.dest, numbers_of(texts))
            except SeipError as error:
                parser.error(f"argument {'/'.join(self.option_strings)}: {error}")

    return Several
