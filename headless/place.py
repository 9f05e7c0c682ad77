"""Place sensors in a scene: visibility of every candidate, the best choice, and the evidence for it.

In Blender, on the scene that is open::

    blender -b --python-exit-code 1 site.blend -P headless/place.py -- --sensor type1 --count 4 -o out/

or as plain Python on the bpy module::

    python -m headless.place site.blend --sensor type1 --count 4 -o out/
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Generator
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeVar

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import session

import bpy
import numpy as np

from seip_addon.core.candidates import CandidateSettings
from seip_addon.core.goal import DEFAULT_COUNT, Goal, placement_problem, reach
from seip_addon.core.lidar import LidarModel, find_models, load_catalogue
from seip_addon.core.needed_triangles import triangles_sentence
from seip_addon.core.pictures.plan_view import save_plan_view
from seip_addon.core.placement import Placement, solve_greedy
from seip_addon.core.progress import Progress, finish
from seip_addon.core.results.candidate_table import save_candidate_table
from seip_addon.core.results.carla import save_carla_spawns
from seip_addon.core.results.deployment import Deployment, deploy
from seip_addon.core.results.placement_record import Record, Run, placement_record, save_placement_record, versions
from seip_addon.core.ring_resolution import resolution_warnings
from seip_addon.core.scene_geometry import SceneGeometry
from seip_addon.core.site import Site, make_site
from seip_addon.core.visibility import VisibilityGrid, VisibilitySettings
from seip_addon.core.visibility_store import stored_visibility
from seip_addon.scene.build import save_blend
from seip_addon.scene.read import read_scene
from seip_addon.scene.render import save_rendered_view
from seip_addon.scene.write import write_result

Result = TypeVar("Result")


@dataclass
class _Clock:
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


def main(argv: list[str]) -> None:
    """Place sensors in a scene and write the result to a folder."""
    options = _parser().parse_args(argv)
    models = find_models(load_catalogue(options.catalogue), options.sensor)
    layout = CandidateSettings(
        tuple(options.sensor), options.heights, options.spacing, options.setback, options.clearance, options.bracket
    )
    visibility = VisibilitySettings(options.delta, options.min_intensity)
    goal = _goal(options)
    layout.check()
    goal.check()
    session.check_folder(options.output)
    session.open_scene(options.scene)
    scene = bpy.context.scene

    clock = _Clock()
    reading = clock.time("read the scene", lambda: read_scene(scene))
    site = clock.time("lay out the site", lambda: make_site(reading.geometry, layout, options.grid))
    session.say(_site_line(site))
    warnings = reading.warnings + resolution_warnings(site, models, visibility)
    for sentence in warnings:
        session.say(f"warning: {sentence}")
    store = options.output / "visibility.npz"
    steps = stored_visibility(store, site, models, visibility, options.engine, options.scheduler)
    grid = clock.run("visibility", steps)
    session.say(triangles_sentence(grid.parameters["triangles"]))
    problem = placement_problem(site, grid.visible, models, goal)
    placement = clock.run("placement", reach(problem, goal, solver=options.solver, time_limit=options.time_limit))
    greedy = None if goal.coverage is not None else clock.time("greedy", lambda: solve_greedy(problem))
    deployment = deploy(site, models, grid.visible, placement.chosen)
    run = Run(
        settings={
            "grid_spacing_m": options.grid,
            "candidates": asdict(layout),
            "visibility": asdict(visibility),
            "goal": asdict(goal) | {"count": problem.count},
            "time_limit_s": options.time_limit,
        },
        created=datetime.now(UTC),
        durations=clock.seconds,
        versions=versions(blender=bpy.app.version_string),
        inputs={"visibility": grid.key},
        warnings=warnings,
    )
    record = placement_record(
        site, deployment, placement, run, weighted=goal.weighted, cheapest=goal.coverage is not None, greedy=greedy
    )
    _write(options, _Outcome(reading.geometry, site, models, grid, placement, deployment), record)
    session.say(_result_lines(deployment, placement, greedy))
    session.say(f"written to {options.output}/")


@dataclass(frozen=True)
class _Outcome:
    geometry: SceneGeometry
    site: Site
    models: dict[str, LidarModel]
    grid: VisibilityGrid
    placement: Placement
    deployment: Deployment


def _write(options: argparse.Namespace, outcome: _Outcome, record: Record) -> None:
    """Write tables, pictures and the scene with its sensors; ``placement.json`` last, as the seal on the rest."""
    folder: Path = options.output
    scene = bpy.context.scene
    site, deployment = outcome.site, outcome.deployment
    (folder / "placement.json").unlink(missing_ok=True)
    save_candidate_table(folder / "candidates.csv", site, outcome.models, outcome.grid.visible, deployment)
    save_carla_spawns(folder / "carla_spawn.json", deployment, site.origin)
    save_plan_view(folder / "plan.png", outcome.geometry, site, deployment)
    write_result(scene, site, deployment)
    save_blend(folder / "placed.blend")
    if not options.no_render:
        save_rendered_view(folder / "view.png", scene, site, deployment)
    save_placement_record(folder / "placement.json", record)


def _goal(options: argparse.Namespace) -> Goal:
    return Goal(
        count=options.count,
        budget=options.budget,
        coverage=options.coverage,
        weighted=options.weighted or options.central_weight is not None,
        central_weight=options.central_weight,
        min_distance=options.min_distance,
        forbidden=tuple(options.forbid),
        mandatory=tuple(options.require),
    )


def _site_line(site: Site) -> str:
    candidates = site.candidates
    dropped = ", ".join(f"{count} {reason}" for reason, count in candidates.dropped.items())
    poles = np.count_nonzero(candidates.on_pole)
    return (
        f"{site.name}: {len(site.targets):,} targets, {len(candidates.position)} positions ({poles} on poles), "
        f"{len(candidates):,} poses, {len(site.triangles):,} triangles" + (f"; dropped: {dropped}" if dropped else "")
    )


def _result_lines(deployment: Deployment, placement: Placement, greedy: Placement | None) -> str:
    lines = [
        f"{sensor.label}  {sensor.model.key} at {sensor.height:g} m, {sensor.position_name}: "
        f"sees {sensor.alone:.1%} of the targets, {sensor.marginal:.1%} alone"
        for sensor in deployment.sensors
    ]
    proven = "proven optimal" if placement.status == "optimal" else f"within {placement.gap:.2%} of the best possible"
    central = "" if deployment.central is None else f", central {deployment.central:.2%}"
    lines.append(f"coverage {deployment.coverage:.2%}{central}, price ${deployment.price:,.0f}, {proven}")
    if greedy is not None:
        lines.append(f"the greedy algorithm reaches {greedy.objective / placement.objective:.2%} of that objective")
    return "\n".join([*lines, *placement.notes])


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="place",
        description="Place roadside LiDARs in a scene.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    layout, sight = CandidateSettings(sensors=()), VisibilitySettings()
    parser.add_argument("scene", nargs="?", type=Path, help="the .blend; in Blender the open scene")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the results")
    sensors = parser.add_argument_group("sensors")
    sensors.add_argument(
        "--sensor", nargs="+", default=["type1", "type2", "type3"], metavar="KEY", help="types to choose from"
    )
    sensors.add_argument("--catalogue", nargs="+", type=Path, default=[], metavar="TOML", help="catalogues of your own")
    sensors.add_argument(
        "--heights", nargs="+", default=layout.heights, action=_Heights, metavar="M", help="metres, or FROM:TO:STEP"
    )
    goal = parser.add_argument_group("goal")
    goal.add_argument(
        "--count", type=int, metavar="N", help=f"largest number of sensors ({DEFAULT_COUNT} if no goal is given)"
    )
    goal.add_argument("--budget", type=float, metavar="USD", help="largest total price")
    goal.add_argument("--coverage", type=float, metavar="SHARE", help="reach this share (0 to 1) at the least price")
    goal.add_argument("--weighted", action="store_true", help="count targets by the weights of their regions")
    goal.add_argument("--central-weight", type=float, metavar="W", help="one weight for all weighted regions")
    goal.add_argument("--min-distance", type=float, default=0.0, metavar="M", help="between two sensors")
    goal.add_argument("--forbid", nargs="+", default=[], metavar="POSITION", help="positions without sensor")
    goal.add_argument("--require", nargs="+", default=[], metavar="POSITION", help="positions with a sensor")
    grid = parser.add_argument_group("grid and candidates, in metres")
    grid.add_argument("--grid", type=float, default=1.0, help="spacing of the targets")
    grid.add_argument("--delta", type=float, default=sight.delta, help="a return closer than this sees a target")
    grid.add_argument("--min-intensity", type=float, default=sight.min_intensity, help="least intensity of that return")
    grid.add_argument("--spacing", type=float, default=layout.spacing, help="between posts on the pavement")
    grid.add_argument("--setback", type=float, default=layout.setback, help="of posts from the kerb")
    grid.add_argument("--clearance", type=float, default=layout.clearance, help="of posts from walls")
    grid.add_argument("--bracket", type=float, default=layout.bracket, help="of sensors from the axis of a pole")
    work = parser.add_argument_group("work")
    work.add_argument("--solver", default="highs", help="highs, cbc or gurobi")
    work.add_argument("--time-limit", type=float, default=60.0, metavar="S", help="for the solver, in seconds")
    work.add_argument("--engine", choices=("auto", "bvh", "embree"), default="auto", help="ray caster")
    work.add_argument("--scheduler", metavar="ADDRESS", help="Dask scheduler whose workers cast, like tcp://host:8786")
    work.add_argument("--no-render", action="store_true", help="leave out the rendered view")
    return parser


class _Heights(argparse.Action):
    """Heights as a list, or a range FROM:TO:STEP with both ends."""

    def __call__(
        self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: object, *_: object
    ) -> None:
        """Store the heights as a tuple of metres."""
        heights: list[float] = []
        for text in values if isinstance(values, list) else []:
            try:
                numbers = [float(part) for part in str(text).split(":")]
            except ValueError:
                numbers = []
            if len(numbers) == 1:
                heights += numbers
            elif len(numbers) == 3 and 0 < numbers[0] <= numbers[1] and numbers[2] > 0:
                first, last, step = numbers
                heights += np.round(np.arange(first, last + step * 1e-6, step), 6).tolist()
            else:
                parser.error(f"argument --heights: {text!r} is neither a height in metres nor a range FROM:TO:STEP")
        setattr(namespace, self.dest, tuple(heights))


if __name__ == "__main__":
    session.run(main)
