"""Operators that solve a placement, compare it with its scene, and edit its constraints."""

from __future__ import annotations

import time
from collections.abc import Generator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import bpy

from .. import preferences
from ..core.base.acceptance import Acceptance
from ..core.base.errors import SeipError
from ..core.base.progress import Progress, altered
from ..core.choosing.placement.objective import Objective, check_objective
from ..core.output.results.answer import answer
from ..core.workflows.detection import DetectionJob
from ..core.workflows.early_answer import after_early_answer, early_answer
from ..core.workflows.finalists import check_judged, find_finalists, judge_elsewhere, judged_solution
from ..core.workflows.placing import place, with_context
from ..core.workflows.survey import Layout
from ..core.workflows.traffic_runs import TrafficRuns, found_runs, read_runs
from ..properties.conversion import runs_folder, saved_path
from ..properties.placement import RULE_ITEMS
from ..scene.write import write_result
from ..state import scene_status, selection
from ..state.session import SceneState, scene_of, session
from ..viewport import coverage, overlays, search
from . import scene_survey
from .base import ForReadyScene, Job, LongWork, ShortWork, started
from .detection import NO_PYTHON, no_python, saved_scene
from .results import keep_result


class SEIP_OT_compare_scene(ForReadyScene, LongWork, bpy.types.Operator):
    """Check whether the placement still matches the scene"""

    bl_label = "Compare with Scene"
    bl_options = {"REGISTER"}  # nothing in the file changes

    def job(self, scene: bpy.types.Scene) -> Job:
        """Read the scene where it has changed: the panel compares."""
        scene, state = yield scene_survey.survey(scene)
        session.of(scene).state = state


@dataclass(frozen=True, eq=False)
class _Searching(Progress):
    """Progress of a search for a placement, with the layout that has its poses."""

    layout: Layout | None = None


class _Placing(LongWork):
    """A mixin: work that ends with a placement; the best so far is drawn while it is searched."""

    _drawn: tuple[int, ...] = ()

    def _show(self, progress: Progress, duration: str) -> None:
        super()._show(progress, duration)
        if isinstance(progress, _Searching) and progress.layout is not None and progress.poses not in {(), self._drawn}:
            self._drawn = progress.poses
            with suppress(SeipError):  # the scene was deleted
                overlays.show(scene_of(self._scene), search.NAME, search.search_overlay(progress.layout, progress))

    def _end(self, context: bpy.types.Context) -> None:
        for scene in bpy.data.scenes:
            overlays.hide(scene, search.NAME)
        super()._end(context)

    def _store(self, scene: bpy.types.Scene, state: SceneState) -> None:
        """Put the sensors into the scene, and all that is needed to go on later into the file."""
        survey, solution = state.placed()
        write_result(scene, survey.site, solution.deployment)
        record = keep_result(scene, state)
        coverage.show_colours(scene)
        self.report({"INFO"}, " ".join(answer(record)[:2]))  # type: ignore[attr-defined]  # of Blender's operators


class SEIP_OT_solve_placement(ForReadyScene, _Placing, bpy.types.Operator):
    """Choose the best sensors for the number, budget or coverage, and place them in the scene"""

    bl_label = "Place Sensors"

    def job(self, scene: bpy.types.Scene) -> Job:
        """Read the scene where it has changed, state the objective, and place sensors."""
        goal = scene.seip.goal
        objective = goal.objective()
        folder = runs_folder(scene.seip.traffic.runs) if objective.scenarios.kind == "traffic" else None
        self.acceptance = Acceptance()
        scene, state = yield _placed(scene_survey.survey(scene), objective, folder, self.acceptance)
        self._store(scene, state)


class SEIP_OT_judge_placement(_Placing, bpy.types.Operator):
    """Place sensors, and choose among twelve good placements by what a detector finds with them in runs of traffic; runs in a separate Python with PyTorch"""  # noqa: E501  # a tooltip is one line

    bl_label = "Choose by Detection"

    obstacles = (scene_status.obstacle, no_python)

    def job(self, scene: bpy.types.Scene) -> Job:
        """Read the scene where it has changed, save it for the process that judges, and place sensors."""
        seip, python = scene.seip, preferences.detecting_python()
        if python is None:
            raise SeipError(NO_PYTHON)
        objective = seip.goal.objective()
        check_judged(objective)
        runs = tuple(found_runs(runs_folder(seip.traffic.runs)))
        job = DetectionJob(python, runs, None, preferences.catalogue_files(), seip.survey.weather())
        folder = saved_path(seip.detection.folder, "the detections")
        self.acceptance = Acceptance()
        steps = _judged(scene_survey.survey(scene), objective, job, folder, self.acceptance)
        scene, state = yield started(steps)
        self._store(scene, state)


def _judged(
    surveying: Generator[Progress, None, SceneState],
    objective: Objective,
    job: DetectionJob,
    folder: Path,
    acceptance: Acceptance,
) -> Generator[Progress, None, SceneState]:
    """Place sensors, and choose among finalists; detections are kept in a folder."""
    with saved_scene(folder) as scene:
        yield Progress(0, 0, "placing sensors")
        state = yield from _placed(surveying, objective, None, acceptance)
        survey, solution = state.placed()
        began = time.perf_counter()
        request = yield from find_finalists(survey, solution)
        judgement = yield from judge_elsewhere(job, request, scene, folder)
        solution = yield from judged_solution(survey, solution, judgement)
        return replace(state, solution=solution, durations=state.timed("judging", began))


def _placed(
    surveying: Generator[Progress, None, SceneState],
    objective: Objective,
    folder: Path | None,
    acceptance: Acceptance,
) -> Generator[Progress, None, SceneState]:
    """Place sensors on a survey; runs of traffic are read, and the objective is checked, before any ray is cast."""
    state = yield from surveying
    runs = None if folder is None else (yield from read_runs(found_runs(folder), state.layout))
    check_objective(state.layout.site, state.layout.models, objective)
    early = yield from early_answer(state.layout, objective, state.grid_file, state.cores)
    steps = after_early_answer(early, _searched(state, objective, runs, acceptance))
    return (yield from altered(steps, lambda step: _Searching(**vars(step), layout=state.layout)))


def _searched(
    state: SceneState, objective: Objective, runs: TrafficRuns | None, acceptance: Acceptance
) -> Generator[Progress, None, SceneState]:
    """Compute visibility where it is not known, and search for the placement."""
    state, survey = yield from scene_survey.with_visibility(state)
    began = time.perf_counter()
    solution = yield from place(survey, objective, runs, acceptance)
    solution = yield from with_context(survey, solution, acceptance)
    return replace(state, solution=solution, durations=state.timed("placement", began))


class SEIP_OT_choose_number(ShortWork, bpy.types.Operator):
    """Make this number of sensors the goal of the next placement; the tick marks the present placement"""

    bl_label = "Choose Number of Sensors"
    bl_options = {"REGISTER", "UNDO"}

    count: bpy.props.IntProperty(name="Sensors", description="Largest number of sensors", min=1, default=1)

    def act(self, context: bpy.types.Context) -> None:
        """Set the goal."""
        goal = context.scene.seip.goal
        goal.limit, goal.count = "COUNT", self.count


class SEIP_OT_add_rule(ShortWork, bpy.types.Operator):
    """Require or forbid a sensor at the position of the selected pole or sensor, or at the named one"""

    bl_options = {"REGISTER", "UNDO"}

    rule: bpy.props.EnumProperty(name="Rule", description="Requirement at the position", items=RULE_ITEMS)

    def act(self, context: bpy.types.Context) -> None:
        """Add it, or change the one that is there."""
        rule = self.rule
        goal = context.scene.seip.goal
        name = goal.position or selection.position_of(context.scene, context.object)
        if not name:
            raise SeipError("name a position, or select a pole or a sensor")
        entry = goal.rules.get(name) or goal.rules.add()
        entry.name, entry.rule = name, rule
        goal.active_rule = goal.rules.find(name)
        goal.position = ""
