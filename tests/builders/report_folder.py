"""The folder of a placement at the small junction, without Blender: for reports."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.concave import relative_gap
from seip_addon.core.choosing.placement.deployment import deploy
from seip_addon.core.choosing.placement.objective import (
    FrontPoint,
    Objective,
    Solution,
    placement_constraints,
    placement_problem,
)
from seip_addon.core.choosing.placement.problem import Placement
from seip_addon.core.choosing.placement.returns_summary import CrossingReturns
from seip_addon.core.choosing.placement.solver import front_of
from seip_addon.core.geometry.geo_reference import GeoReference
from seip_addon.core.output.pictures.drawing import save_png
from seip_addon.core.output.pictures.plan_view import draw_plan
from seip_addon.core.output.results.placement_record import Provenance, placement_record, save_placement
from seip_addon.core.output.results.site_file import save_site_file
from seip_addon.core.sensing.visibility.grid import VisibilityGrid
from seip_addon.core.site.locations import locations
from seip_addon.core.site.scene_geometry import NamedArea
from seip_addon.core.storage.json_dataclass import as_json
from tests.builders.small_junction import Example, make_example

NAME = "Crossing <script>alert(1)</script> & “Ecke”"
CREATED = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
UTM = GeoReference("EPSG:32632", (-4_500_000.0, 5_300_000.0, 400.0, 0.0))
KEY = "ab" * 32
CROSSING = CrossingReturns("Crossing of High Street", 4.25)


def make_folder(
    folder: Path,
    *,
    goal: Objective | None = None,
    place: GeoReference = UTM,
    effort: float = 0.0,
    pictures: bool = False,
    **found,
) -> Example:
    """Write what `seip place` writes, but for what only Blender can, and return what it is about.

    The front of other numbers of sensors is searched for with an effort above 0. Pictures take most of the time.
    """
    example = make_example()
    example = replace(
        example,
        site=replace(example.site, name=NAME, geo_reference=place),
        geometry=replace(
            example.geometry,
            places=(
                NamedArea("Mill Lane \u202e<i>", shapely.box(-55, -7, -7, 7)),
                NamedArea("High Street", shapely.box(7, -7, 55, 7)),
                NamedArea(CROSSING.name, shapely.box(9, -7, 13, 7), crossing=True),
            ),
        ),
    )
    goal = goal or Objective(count=3)
    solution = replace(make_solution(example, goal, **found), crossings=(CROSSING,))
    problem = placement_problem(example.site, example.visible, example.models, goal)
    if effort:
        whole, own = len(example.site.targets), len(solution.placement.chosen)
        front = finish(front_of(problem, solution.placement, range(own - 1, own + 1), effort)).items()
        points = (
            FrontPoint(count, one.objective / whole, one.price, (one.bound - one.objective) / whole)
            for count, one in front
        )
        solution = replace(solution, front=tuple(points))
    deployment = solution.deployment
    settings = {
        "grid_spacing_m": 2.0,
        "candidates": {"sensors": ["type1", "type2"], "heights": [3.5, 5.4]},
        "goal": as_json(goal),
        "render": False,
    }
    record = placement_record(
        example.site,
        solution,
        Provenance(CREATED, {"visibility": 1.0}, {"seip": "0.1.0", "python": "3.13.0"}),
        settings=settings,
        inputs={"visibility": KEY},
        warnings=("type2: sees <far>",),
    )
    feet = np.array([sensor.foot[:2] for sensor in deployment.sensors])
    named = zip(record.sensors, locations(example.geometry, feet), strict=True)
    record = replace(record, sensors=tuple(replace(sensor, location=words) for sensor, words in named))
    folder.mkdir(parents=True, exist_ok=True)
    save_placement(folder / "placement.json", record)
    problem = placement_constraints(example.site, example.models, goal)
    save_site_file(folder / "site.npz", KEY, example.geometry, example.site, solution, problem)
    VisibilityGrid(np.packbits(example.visible, axis=1), example.visible.shape, KEY, {}).save(folder / "visibility.npz")
    if pictures:
        save_png(folder / "plan.png", draw_plan(example.geometry, example.site, deployment))
    return example


def make_solution(example: Example, goal: Objective, **found) -> Solution:
    chosen = np.array([sensor.pose for sensor in example.deployment.sensors])
    deployment = example.deployment
    if "chosen" in found:
        chosen = found.pop("chosen")
        deployment = deploy(example.site, example.models, example.visible[chosen], chosen)
    value = float(np.count_nonzero(deployment.seen_by))
    values = {"objective": value, "bound": value, "status": "optimal", **found}
    values.setdefault("gap", relative_gap(values["objective"], values["bound"]))
    placement = Placement(chosen=chosen, solver="HiGHS", price=deployment.price, **values)
    return Solution(goal, placement, None, deployment)
