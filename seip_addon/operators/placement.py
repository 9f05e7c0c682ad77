"""Operators that solve a placement and edit its constraints."""

from __future__ import annotations

import time
from collections.abc import Generator
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

import bpy

from .. import scene_survey, selection
from ..core.errors import SeipError
from ..core.placement.objective import Objective, check_objective
from ..core.progress import Progress
from ..core.results.placement_record import versions
from ..core.robustness.robust_study import RobustnessSettings
from ..core.workflows.robust import check_robust_objective, place_robustly
from ..core.workflows.survey import Layout, Provenance, place, record_of
from ..core.workflows.traffic import TrafficRuns, TrafficSettings, place_in_traffic, read_runs, runs_in
from ..scene.write import write_result
from ..session import SceneSurvey
from .results import keep_result
from .work import ForReadyScene, LongWork, Outcome, attempt


class SEIP_OT_solve_placement(ForReadyScene, LongWork[SceneSurvey], bpy.types.Operator):
    """Choose the sensors that cover most, or the cheapest that cover enough, and put them into the scene"""

    bl_idname = "seip.solve_placement"
    bl_label = "Place Sensors"

    def prepare(self, scene: bpy.types.Scene) -> Generator[Progress, None, SceneSurvey]:
        """Read the scene where it has changed, and state the goal."""
        asked = scene.seip.goal
        robustness, traffic = asked.robustness(), asked.traffic()
        self._pose_errors = asked.pose_errors and robustness is None and traffic is None
        self._traffic = None if traffic is None else asdict(traffic)
        if traffic is None:
            return _placed(scene_survey.survey(scene), asked.goal(), robustness, pose_errors=self._pose_errors)
        folder = asked.runs_folder()
        return _placed_in_traffic(scene_survey.survey(scene), asked.goal(), traffic, folder)

    def conclude(self, scene: bpy.types.Scene, result: SceneSurvey) -> None:
        """Put the sensors into the scene, and all that is needed to go on later into the file."""
        if result.plan is None or result.grid is None:
            raise RuntimeError("the work ended without a placement")
        deployment = result.plan.deployment
        circumstances = Provenance(datetime.now(UTC), result.durations, versions(blender=bpy.app.version_string))
        record = record_of(
            result.layout,
            result.grid,
            result.plan,
            circumstances,
            render=False,
            pose_errors=self._pose_errors,
            traffic=self._traffic,
        )
        write_result(scene, result.layout.site, deployment)
        keep_result(scene, result, record)
        self.report({"INFO"}, f"coverage {deployment.coverage:.2%}, price ${deployment.price:,.0f}")


def _placed(
    surveying: Generator[Progress, None, SceneSurvey],
    goal: Objective,
    robustness: RobustnessSettings | None,
    *,
    pose_errors: bool = False,
) -> Generator[Progress, None, SceneSurvey]:
    if robustness is not None:
        check_robust_objective(goal)
    known = yield from surveying
    check_objective(known.layout.site, known.layout.models, goal)
    known, grid = yield from scene_survey.with_visibility(known)
    began = time.perf_counter()
    if robustness is None:
        plan = yield from place(known.layout, grid, goal, pose_errors=pose_errors)
    else:
        plan = (yield from place_robustly(known.layout, grid, goal, robustness)).solution
    return replace(known, plan=plan, durations=known.timed("placement", began))


def _placed_in_traffic(
    surveying: Generator[Progress, None, SceneSurvey], goal: Objective, settings: TrafficSettings, folder: Path
) -> Generator[Progress, None, SceneSurvey]:
    check_robust_objective(goal)
    known = yield from surveying
    check_objective(known.layout.site, known.layout.models, goal)
    runs = yield from _read_runs(folder, known.layout)  # refuses before any ray is cast
    known, grid = yield from scene_survey.with_visibility(known)
    began = time.perf_counter()
    placed = yield from place_in_traffic(known.layout, grid, goal, runs, settings)
    return replace(known, plan=placed.solution, durations=known.timed("placement", began))


def _read_runs(folder: Path, layout: Layout) -> Generator[Progress, None, TrafficRuns]:
    paths = runs_in(folder)
    if not paths:
        raise SeipError(
            f"there is no run of traffic (.npz) in {folder}: choose another folder, or make two or more runs with "
            "headless/traffic.py, a seed each"
        )
    return (yield from read_runs(paths, layout))


class SEIP_OT_add_rule(bpy.types.Operator):
    """Demand, or forbid, a sensor at the position of the selected pole or sensor, or at the one that is named"""

    bl_idname = "seip.add_rule"
    bl_label = "Add Rule"
    bl_options = {"REGISTER", "UNDO"}

    rule: bpy.props.EnumProperty(
        name="Rule",
        description="What must be at the position",
        items=(("MANDATORY", "Sensor", "There must be a sensor"), ("FORBIDDEN", "No sensor", "There must be none")),
    )

    def execute(self, context: bpy.types.Context) -> Outcome:
        """Add it, or change the one that is there."""
        return attempt(self, lambda: self._add(context, self.rule))

    def _add(self, context: bpy.types.Context, rule: Literal["MANDATORY", "FORBIDDEN"]) -> None:
        goal = context.scene.seip.goal
        name = goal.position or selection.position_of(context.scene, context.object)
        if not name:
            raise SeipError("name a position, or select a pole or a sensor")
        entry = goal.rules.get(name) or goal.rules.add()
        entry.name, entry.rule = name, rule
        goal.active_rule = goal.rules.find(name)
        goal.position = ""


class SEIP_OT_remove_rule(bpy.types.Operator):
    """Take a rule off the list"""

    bl_idname = "seip.remove_rule"
    bl_label = "Remove Rule"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Tell whether there is a rule to remove."""
        goal = context.scene.seip.goal
        return goal.active_rule in range(len(goal.rules))

    def execute(self, context: bpy.types.Context) -> Outcome:
        """Remove the active one."""
        goal = context.scene.seip.goal
        goal.rules.remove(goal.active_rule)
        goal.active_rule = max(0, goal.active_rule - 1)
        return {"FINISHED"}


CLASSES = (SEIP_OT_solve_placement, SEIP_OT_add_rule, SEIP_OT_remove_rule)
