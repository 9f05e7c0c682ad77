"""Operators that solve a placement and edit its constraints."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from dataclasses import asdict, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Literal

import bpy

from .. import scene_survey, selection
from ..core.errors import SeipError
from ..core.placement.objective import Objective, Solution, check_objective
from ..core.progress import Progress
from ..core.results.placement_record import Provenance, versions
from ..core.robustness.robust_study import RobustnessSettings
from ..core.workflows.robust import check_robust_objective, place_robustly
from ..core.workflows.survey import Survey, place, record_of
from ..core.workflows.traffic import TrafficSettings, found_runs, place_in_traffic, read_runs
from ..properties.conversion import runs_folder
from ..scene.write import write_result
from ..session import SceneState
from ..viewport import coverage
from .base import ForReadyScene, LongWork, Outcome, attempt
from .results import keep_result

_Placing = Callable[[Survey], Generator[Progress, None, Solution]]


class SEIP_OT_solve_placement(ForReadyScene, LongWork[SceneState], bpy.types.Operator):
    """Choose the sensors that cover most, or the cheapest that cover enough, and put them into the scene"""

    bl_idname = "seip.solve_placement"
    bl_label = "Place Sensors"

    def prepare(self, scene: bpy.types.Scene) -> Generator[Progress, None, SceneState]:
        """Read the scene where it has changed, and state the objective."""
        asked = scene.seip.goal
        objective, robustness, traffic = asked.goal(), asked.robustness(), asked.traffic()
        if robustness is not None or traffic is not None:
            check_robust_objective(objective, robustness and robustness.risk)
        surveying = scene_survey.survey(scene)
        self._asked: dict[str, object] = {}
        if traffic is not None:
            self._asked = {"traffic": asdict(traffic)}
            return _placed_in_traffic(surveying, objective, traffic, runs_folder(asked.runs))
        if robustness is not None:
            self._asked = {"robustness": robustness.as_record()}
            return _placed(surveying, objective, partial(_robust, objective=objective, settings=robustness))
        self._asked = {"pose_errors": asked.pose_errors}
        return _placed(surveying, objective, partial(place, objective=objective, pose_errors=asked.pose_errors))

    def conclude(self, scene: bpy.types.Scene, result: SceneState) -> None:
        """Put the sensors into the scene, and all that is needed to go on later into the file."""
        survey, solution = result.placed()
        deployment = solution.deployment
        provenance = Provenance(datetime.now(UTC), result.durations, versions(blender=bpy.app.version_string))
        record = record_of(survey, solution, provenance, self._asked)
        write_result(scene, survey.site, deployment)
        keep_result(scene, result, record)
        coverage.show_colours(scene)
        self.report({"INFO"}, f"coverage {deployment.coverage:.2%}, price {record.price_text}")


def _placed(
    surveying: Generator[Progress, None, SceneState], objective: Objective, placing: _Placing
) -> Generator[Progress, None, SceneState]:
    return (yield from _placed_on((yield from surveying), objective, placing))


def _placed_on(state: SceneState, objective: Objective, placing: _Placing) -> Generator[Progress, None, SceneState]:
    check_objective(state.layout.site, state.layout.models, objective)
    state, survey = yield from scene_survey.with_visibility(state)
    began = time.perf_counter()
    solution = yield from placing(survey)
    return replace(state, solution=solution, durations=state.timed("placement", began))


def _robust(survey: Survey, objective: Objective, settings: RobustnessSettings) -> Generator[Progress, None, Solution]:
    return (yield from place_robustly(survey, objective, settings)).solution


def _placed_in_traffic(
    surveying: Generator[Progress, None, SceneState], objective: Objective, settings: TrafficSettings, folder: Path
) -> Generator[Progress, None, SceneState]:
    state = yield from surveying
    runs = yield from read_runs(found_runs(folder), state.layout)  # refuses before any ray is cast

    def placing(survey: Survey) -> Generator[Progress, None, Solution]:
        return (yield from place_in_traffic(survey, objective, runs, settings)).solution

    return (yield from _placed_on(state, objective, placing))


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
        """Return whether there is a rule to remove."""
        goal = context.scene.seip.goal
        return goal.active_rule in range(len(goal.rules))

    def execute(self, context: bpy.types.Context) -> Outcome:
        """Remove the active one."""
        goal = context.scene.seip.goal
        goal.rules.remove(goal.active_rule)
        goal.active_rule = max(0, goal.active_rule - 1)
        return {"FINISHED"}


CLASSES = (SEIP_OT_solve_placement, SEIP_OT_add_rule, SEIP_OT_remove_rule)
