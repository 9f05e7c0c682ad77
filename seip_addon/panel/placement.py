"""The step "Placement": the search for the best sensors, and the answer."""

from __future__ import annotations

import time
from collections.abc import Generator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import bpy
import numpy as np

from ..core.base.acceptance import Acceptance
from ..core.base.counts import counted, duration_text
from ..core.base.errors import SeipError
from ..core.base.progress import Progress, altered
from ..core.choosing.placement.objective import Objective, certificate, check_objective, purpose
from ..core.choosing.placement.returns_summary import returns_text
from ..core.output.pictures.palette import SENSOR_BODY, rgb
from ..core.output.results.answer import answer, sentence, status_text
from ..core.output.results.placement_record import PlacementRecord, parsed_record, relevant_warnings
from ..core.site.obstruction import NO_OBSTACLES_MESSAGE
from ..core.workflows.detection import DetectionJob
from ..core.workflows.early_answer import after_early_answer, early_answer
from ..core.workflows.finalists import check_judged, find_finalists, judge_elsewhere, judged_solution
from ..core.workflows.placing import place, with_context
from ..core.workflows.survey import Layout
from ..core.workflows.traffic_runs import TrafficRuns, found_runs, read_runs
from ..scene.sensors import labelled_sensors
from ..scene.write import write_result
from . import coverage, overlays, scene_status
from .detection import detection_job, no_python, saved_scene
from .layout import (
    BETWEEN,
    BOX,
    Status,
    draw_lines,
    draw_reason,
    draw_run,
    draw_sections,
    draw_sentence,
    is_narrow,
    settings_column,
    sidebar_width,
)
from .legend import Block, Colour, Entry, Label
from .objective import draw_objective, draw_rules
from .overlays import Layer, Overlay
from .properties import runs_folder, saved_path
from .results import keep_result
from .scene_status import is_changed, no_placement, sensor_edits
from .session import SceneState, scene_of, session
from .survey import draw_candidates, draw_search, read_layout, with_visibility
from .work import ForReadyScene, Job, LongWork, started

SEARCH = "search"
COLOUR: Colour = (*rgb(SENSOR_BODY), 1.0)
DOT, POST = 12.0, 3.0  # pixels at the interface's usual scale
FRONT = "The best placement found for each number; the report says how much better others could be."
NAME_SHARE = 0.68
"""Share of a row that the name of a figure takes."""
NUMBER_SHARE = 0.3
"""Share of a row that a number of sensors takes, beside the bar of its coverage."""


def search_overlay(layout: Layout, found: Progress) -> Overlay:
    """Return the sensors of the placement that a search reports, with its value in the legend."""
    candidates, poses = layout.site.candidates, list(found.poses)
    eyes = candidates.xyz[poses]
    feet = candidates.position[candidates.position_of[poses]]
    posts = np.stack((feet, eyes), axis=1).reshape(-1, 3)
    layers = (
        Layer("LINES", posts.astype(np.float32), COLOUR, POST),
        Layer("POINTS", eyes.astype(np.float32), COLOUR, DOT),
    )
    value = found.best.partition(",")[0]  # returns are followed by those from each kind of road user
    block = Block("Searching", (Entry(f"best so far: {value}", (COLOUR,)),))
    names = [layout.models[key].short_name for key in candidates.sensor[poses]]
    labels: list[Label] = list(zip(names, map(tuple, eyes.tolist()), strict=True))
    return Overlay(layers, lambda _scene: block, labels=lambda _scene: labels)


class SEIP_OT_compare_scene(ForReadyScene, LongWork, bpy.types.Operator):
    """Check whether the placement still matches the scene"""

    bl_label = "Compare with Scene"
    bl_options = {"REGISTER"}  # nothing in the file changes

    def job(self, scene: bpy.types.Scene) -> Job:
        """Read the scene where it has changed: the panel compares."""
        scene, state = yield read_layout(scene)
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
                overlays.show(scene_of(self._scene), SEARCH, search_overlay(progress.layout, progress))

    def _end(self, context: bpy.types.Context) -> None:
        for scene in bpy.data.scenes:
            overlays.hide(scene, SEARCH)
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
        scene, state = yield _placed(read_layout(scene), objective, folder, self.acceptance)
        self._store(scene, state)


class SEIP_OT_judge_placement(_Placing, bpy.types.Operator):
    """Place sensors, and choose among twelve good placements by what a detector finds with them in runs of traffic; runs in a separate Python with PyTorch"""  # noqa: E501  # a tooltip is one line

    bl_label = "Choose by Detection"

    obstacles = (scene_status.obstacle, no_python)

    def job(self, scene: bpy.types.Scene) -> Job:
        """Read the scene where it has changed, save it for the process that judges, and place sensors."""
        objective = scene.seip.goal.objective()
        check_judged(objective)
        job = detection_job(scene, None)
        folder = saved_path(scene.seip.detection.folder, "the detections")
        self.acceptance = Acceptance()
        steps = _judged(read_layout(scene), objective, job, folder, self.acceptance)
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
    early = yield from early_answer(state.layout, objective, state.grid_file)
    steps = after_early_answer(early, _searched(state, objective, runs, acceptance))
    return (yield from altered(steps, lambda step: _Searching(**vars(step), layout=state.layout)))


def _searched(
    state: SceneState, objective: Objective, runs: TrafficRuns | None, acceptance: Acceptance
) -> Generator[Progress, None, SceneState]:
    """Compute visibility where it is not known, and search for the placement."""
    state, survey = yield from with_visibility(state)
    began = time.perf_counter()
    solution = yield from place(survey, objective, runs, acceptance)
    solution = yield from with_context(survey, solution, acceptance)
    return replace(state, solution=solution, durations=state.timed("placement", began))


def status(scene: bpy.types.Scene) -> Status:
    """Return quality, price and certificate of the placement for the header, and whether it is out of date."""
    if scene_status.has_unevaluated(scene):
        return Status(result=(counted(len(labelled_sensors(scene, hidden=True)), "sensor"), "not evaluated"))
    if no_placement(scene):
        return Status(result=("none yet",))
    parts = status_text(parsed_record(scene.seip.result.record)).split(BETWEEN)
    return Status(is_changed(scene) or bool(scene_status.other_goal(scene)), tuple(parts))


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the goal, the button and the answer, then the closed sections with all other settings."""
    scene = context.scene
    if draw_reason(layout, scene_status.NO_SITE if scene_status.has_nothing(scene) else ""):
        return
    goal = scene.seip.goal
    column = settings_column(layout)
    row = column.row()
    row.use_property_split = False  # else there is no room for three words
    if is_narrow(context):
        row.prop(goal, "limit", text="")
    else:
        row.prop(goal, "limit", expand=True)  # an empty text would leave each segment without its name
    column.prop(goal, goal.limit.lower())
    draw_run(layout, "seip.solve_placement", text=button_text(scene))
    obstacle = scene_status.obstacle(scene)
    if obstacle:
        draw_sentence(layout, obstacle, icon="ERROR")
    elif (check := session.of(scene).check) and not scene_status.stale_check(scene):
        for problem in check.found.problems:  # the result says little of a real site: not only in a closed section
            if problem.text == NO_OBSTACLES_MESSAGE:
                draw_sentence(layout, sentence(problem.text), icon="ERROR")
    if not no_placement(scene):
        _draw_answer(layout, scene)
    elif scene_status.has_unevaluated(scene):
        draw_sentence(layout, scene_status.UNEVALUATED, icon="INFO")
        draw_run(layout, "seip.evaluate_sensors")
    if not no_python(scene):
        draw_run(layout, "seip.judge_placement")
    draw_sections(
        layout,
        {
            "objective": draw_objective,
            "rules": draw_rules,
            "candidates": draw_candidates,
            "search": draw_search,
        },
        scene,
    )


def button_text(scene: bpy.types.Scene) -> str:
    """Return what the button will do, and at most how long it takes, about."""
    goal = scene.seip.goal
    what = {
        "COUNT": f"Place {counted(goal.count, 'Sensor')}",
        "BUDGET": f"Place for ${goal.budget:,.0f}",
        "COVERAGE": f"Cover {goal.coverage:g}%",
    }[goal.limit]
    seconds = scene_status.search_seconds(scene)
    return what if seconds is None else f"{what}, up to {duration_text(5.0 * max(1.0, round(seconds / 5.0)))}"


def _draw_answer(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw the answer in three lines and its details, after the reasons why it is not of the scene as it is."""
    record = parsed_record(scene.seip.result.record)
    box = layout.box()
    doubts = scene_status.doubts(scene)
    for text in doubts:
        draw_sentence(box, text, icon="ERROR", reserved=BOX)
    stale = scene_status.stale_placement(scene)
    if stale and stale != scene_status.ANOTHER_SITE:
        draw_run(box, "seip.compare_scene")
    if sensor_edits(scene):
        draw_run(box, "seip.evaluate_sensors")
    other_goal = "" if doubts else scene_status.other_goal(scene)
    if other_goal:
        draw_sentence(box, other_goal, icon="INFO", reserved=BOX)
    column = box.column()
    if doubts:  # dimmed text could not be read in a light theme
        draw_sentence(column, "Figures of the last placement:", reserved=BOX)
    if scene.seip.result.change:
        draw_sentence(column, scene.seip.result.change, icon="INFO", reserved=BOX)
    for text in answer(record):
        draw_sentence(column, text, reserved=BOX)
    others = {"numbers": partial(_draw_numbers, goal=scene.seip.goal)} if numbers(record) else {}
    draw_sections(box, {**others, "details": partial(_draw_details, certain=not doubts)}, record)


def _draw_numbers(layout: bpy.types.UILayout, record: PlacementRecord, *, goal: bpy.types.PropertyGroup) -> None:
    """Draw quality and price of the best placement of each number of sensors, with a button that chooses it."""
    column = layout.column(align=True)
    for count, share, text in numbers(record):
        row = column.split(factor=NUMBER_SHARE, align=True)
        button = row.operator(
            "seip.choose_number",
            text=str(count),
            icon="CHECKMARK" if count == len(record.sensors) else "BLANK1",
            depress=goal.limit == "COUNT" and goal.count == count,
        )
        button.count = count
        row.progress(factor=share, text=text)
    draw_sentence(layout, FRONT, icon="INFO", reserved=BOX)


def numbers(record: PlacementRecord) -> list[tuple[int, float, str]]:
    """Return numbers of sensors, each with the length of its bar and its quality and price as text."""
    if record.returns is None:
        return [(point.count, point.coverage, f"{point.coverage:.1%} · ${point.price:,.0f}") for point in record.front]
    front = record.returns.front
    most = max((point.returns for point in front), default=0.0) or 1.0
    return [
        (point.count, point.returns / most, f"{returns_text(point.returns)} · ${point.price:,.0f}") for point in front
    ]


def _draw_details(layout: bpy.types.UILayout, record: PlacementRecord, *, certain: bool) -> None:
    """Draw all figures by topic, the certificate while it holds, and the notes."""
    for topic, lines in figures(record).items():
        if not lines:
            continue
        layout.label(text=topic)
        column = layout.column(align=True)
        for name, value in lines:
            row = column.split(factor=NAME_SHARE)
            draw_sentence(row, name, reserved=BOX + (1.0 - NAME_SHARE) * sidebar_width())
            draw_lines(row, [value])
    if certain:
        objective, notes = record.objective, record.notes
        proven = objective.status == "optimal" and not purpose(notes)  # of the coverage that is shown above
        proof = certificate(objective.status, objective.gap, cheapest=objective.cheapest, notes=notes)
        draw_sentence(layout, proof, icon="CHECKMARK" if proven else "INFO", reserved=BOX)
    # warnings about a sensor type are shown with the type
    for note in (*record.notes, *relevant_warnings(record.warnings, record.request.candidates.sensors, ())):
        draw_sentence(layout, sentence(note), icon="INFO", reserved=BOX)


def figures(record: PlacementRecord) -> dict[str, list[tuple[str, str]]]:
    """Return the figures of a placement as text, by topic."""
    coverage, objective = record.coverage, record.objective
    seen = [("Road", f"{coverage.whole:.2%}")]
    if coverage.central is not None:
        seen.append(("In weighted regions", f"{coverage.central:.2%}"))
    if objective.kind == "weighted":
        seen.append(("By weight", f"{coverage.weighted:.2%}"))
    if coverage.gain_band is not None and coverage.gain_band.sheets:
        seen.append(("With plausible gains", f"{coverage.gain_band.low:.0%} to {coverage.gain_band.high:.0%}"))
    returns: list[tuple[str, str]] = []
    crossings: list[tuple[str, str]] = []
    if record.returns is not None:
        returns = [(name.capitalize(), returns_text(number)) for name, number in record.returns.of_each.items()]
        crossings = [(crossing.name, returns_text(crossing.least)) for crossing in record.returns.crossings]
    price = [(sensor.id, f"${sensor.price_usd:,.0f}") for sensor in record.sensors]
    return {
        "Seen": seen,
        "Returns in Each Revolution": returns,
        "Pedestrian's Returns at Worst Point": crossings,
        "Price": [*price, ("Total", record.price_text)],
    }
