"""Operators on results: inspect, compare, move sensors, export.

`tests/addon/test_results_operators.py` shows its use.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from functools import lru_cache
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
from mathutils import Vector

from .. import preferences
from ..core.base.errors import SeipError
from ..core.base.progress import Progress
from ..core.choosing.placement.objective import Objective
from ..core.output.pictures.colours import compare, packed_counts, unpacked_counts
from ..core.output.report.sections import write_report
from ..core.output.results.answer import answer, change_text, sentence
from ..core.output.results.file_names import REPORT_FILES
from ..core.output.results.placement_record import PlacementRecord, Provenance, load_placement, parsed_record
from ..core.output.results.versions import versions
from ..core.sensing.scans.sensor import MountedSensor
from ..core.sensing.visibility.visibility_model import VisibilityModel, visibility_model
from ..core.storage.files import check_folder, digest
from ..core.workflows.moved_sensors import evaluate_moved_sensors
from ..core.workflows.records import record_of
from ..core.workflows.returns import SensorReturns
from ..properties.conversion import complaint, saved_path
from ..scene.blend_file import save_blend
from ..scene.coverage_colours import recolour, show_seen_by
from ..scene.gltf import save_glb
from ..scene.pieces import tidy_pieces
from ..scene.read import attribution_of
from ..scene.render_elsewhere import render_elsewhere
from ..scene.result_folder import result_files, write_pictures, write_tables
from ..scene.sensors import labelled_sensors, placed_sensors, read_sensors
from ..scene.write import coverage_of, shown_legend, take_over
from ..state import live_coverage, scene_status
from ..state.sensor_edits import position_names, sensor_edits
from ..state.session import SceneState, session
from . import scene_survey
from .base import ForReadyScene, Job, LongWork, Obstacles, Outcome, ShortWork, started

OTHER_TARGETS = "The two placements were made on different targets: only their figures can be compared."
_FILES = {"Plan": "plan.png", "Report": REPORT_FILES[0]}
_RECORD = "placement.json"
EYE_DISTANCE = 10.0
"""Metres from a sensor's eye to the point that the view turns about."""


def no_placement(scene: bpy.types.Scene) -> str:
    """Say that there is no placement that can be shown; empty if there is one."""
    if scene_status.is_newer(scene):
        return scene_status.NEWER
    if not scene.seip.result.record:
        missing = "There is no placement yet: place sensors first."
        return scene_status.UNEVALUATED if scene_status.has_unevaluated(scene) else missing
    return complaint(lambda: parsed_record(scene.seip.result.record))


class ForPlacement(ForReadyScene):
    """Mixin that enables an operator only where the scene has a placement."""

    obstacles: Obstacles = (*ForReadyScene.obstacles, no_placement)


def no_folder(scene: bpy.types.Scene) -> str:
    """Say why there is no folder yet to write the result to, and the cure; empty if there is one."""
    problem = complaint(lambda: saved_path(scene.seip.result.folder, "the result"))
    return sentence(problem) if problem else ""


def not_evaluated(scene: bpy.types.Scene) -> str:
    """Say what was done by hand to the sensors since they were placed or evaluated; empty if nothing was."""
    edits = sensor_edits(scene).describe()
    return f"{edits} Press Evaluate Sensors, or undo." if edits else ""


class SEIP_OT_look_from_sensor(ForPlacement, ShortWork, bpy.types.Operator):
    """Look from the sensor that is active in the list towards the road"""

    bl_label = "View from Sensor"

    def act(self, context: bpy.types.Context) -> None:
        """Set the view."""
        empty = active_sensor(context.scene)
        if context.space_data is None or context.space_data.type != "VIEW_3D":
            raise SeipError("there is no 3D view here: press this in the sidebar of one")
        eye = empty.matrix_world.translation
        way = (_middle_of_road(context.scene) - eye).normalized()
        view = context.space_data.region_3d
        view.view_perspective = "PERSP"
        view.view_rotation = (-way).to_track_quat("Z", "Y")
        view.view_distance = EYE_DISTANCE
        view.view_location = eye + EYE_DISTANCE * way


def active_sensor(scene: bpy.types.Scene) -> bpy.types.Object:
    """Return the empty of the sensor that is active in the list, or raise a `SeipError`."""
    label = scene.seip.result.active_label()
    empty = placed_sensors(scene).get(label)
    if empty is None:
        raise SeipError(f"the sensor {label} is no longer in the scene: undo, or place again")
    return empty


def _middle_of_road(scene: bpy.types.Scene) -> Vector:
    """Return the middle of the coverage, or the origin where it is gone."""
    coverage = coverage_of(scene)
    corners = [] if coverage is None else [coverage.matrix_world @ Vector(corner) for corner in coverage.bound_box]
    return sum(corners, Vector()) / len(corners) if corners else Vector()


class SEIP_OT_keep_placement(ForPlacement, ShortWork, bpy.types.Operator):
    """Keep the present placement, to compare later ones with it; its name in the list can be changed"""

    bl_options = {"REGISTER", "UNDO"}

    name: bpy.props.StringProperty(name="Name", description="Name of the kept placement; numbered if empty")

    obstacles = (*ForPlacement.obstacles, not_evaluated)

    def act(self, context: bpy.types.Context) -> None:
        """Keep it, in place of another of that name."""
        seip = context.scene.seip
        free = (f"Placement {number}" for number in count(1))
        name = self.name.strip() or next(name for name in free if name not in seip.kept)
        entry = seip.kept.get(name) or seip.kept.add()
        entry.name = name
        for field in ("record", "targets", "seen"):
            setattr(entry, field, getattr(seip.result, field))
        seip.active_kept = seip.kept.find(name)


class SEIP_OT_remove_entry(bpy.types.Operator):
    """Remove the active entry of the list"""

    bl_idname = "seip.remove_entry"
    bl_label = "Remove"
    bl_options = {"REGISTER", "UNDO"}

    of: bpy.props.EnumProperty(
        name="List",
        description="List that the entry is removed from",
        items=(("RULES", "Rules", "Positions with a rule"), ("KEPT", "Placements", "Placements that were kept")),
    )

    def execute(self, context: bpy.types.Context) -> Outcome:
        """Remove it, if there is one."""
        seip = context.scene.seip
        owner, entries, active = (seip.goal, seip.goal.rules, "active_rule")
        if self.of == "KEPT":
            owner, entries, active = (seip, seip.kept, "active_kept")
        number = getattr(owner, active)
        if number not in range(len(entries)):
            return {"CANCELLED"}
        entries.remove(number)
        setattr(owner, active, max(0, number - 1))
        return {"FINISHED"}


class SEIP_OT_show_comparison(ForPlacement, ShortWork, bpy.types.Operator):
    """Colour the road by the placements that see it: both, only the kept one, only the present one or neither"""

    bl_label = "Show Difference"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context: bpy.types.Context) -> None:
        """Colour the road."""
        scene = context.scene
        seip = scene.seip
        if not 0 <= seip.active_kept < len(seip.kept):
            raise SeipError("keep a placement first, to compare the present one with it")
        kept = seip.kept[seip.active_kept]
        if kept.targets != seip.result.targets:
            raise SeipError(OTHER_TARGETS)
        recolour(scene, compare(unpacked_counts(kept.seen), unpacked_counts(seip.result.seen)))
        scene.seip.view.legend = True


class SEIP_OT_follow_sensors(ForPlacement, LongWork, bpy.types.Operator):
    """Toggle live coverage while sensors are moved or turned by hand"""

    bl_label = "Follow Moved Sensors"
    bl_options = {"REGISTER"}

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        """End it at once, or begin in a thread."""
        return self.execute(context) if session.following is not None else super().invoke(context, event)

    def execute(self, context: bpy.types.Context) -> Outcome:
        """End it, or begin."""
        if session.following is not None:
            live_coverage.stop()
            return {"FINISHED"}
        return super().execute(context)

    def job(self, scene: bpy.types.Scene) -> Job:
        """Restore the placement, and begin to follow."""
        scene, (state, model, returns) = yield _set_up(scene_survey.with_placement(scene))
        session.of(scene).state = state
        live_coverage.start(scene, state, model, returns)


def _set_up(
    finding: Generator[Progress, None, SceneState],
) -> Generator[Progress, None, tuple[SceneState, VisibilityModel, SensorReturns | None]]:
    """Return what following sensors needs."""
    state = yield from finding
    settings = state.layout.settings
    yield Progress(0, 0, "getting ready to cast")
    visibility = visibility_model(state.layout.site, settings.visibility, settings.engine)
    _, solution = state.placed()
    of_returns = solution.deployment.returns is not None
    return state, visibility, SensorReturns(state.layout, solution.objective) if of_returns else None


class SEIP_OT_evaluate_sensors(ForReadyScene, LongWork, bpy.types.Operator):
    """Evaluate the sensors of the scene at their present poses, and make them the placement"""

    obstacles = (
        *ForReadyScene.obstacles,
        lambda scene: "" if scene_status.has_unevaluated(scene) else no_placement(scene),
    )

    def job(self, scene: bpy.types.Scene) -> Job:
        """Evaluate the sensors; those without a placement are evaluated under the goal of the panel."""
        mounted = read_sensors(scene, preferences.catalogue(), hidden=True)
        text, names = scene.seip.result.record, position_names(scene)
        record = parsed_record(text) if text else None
        objective = scene.seip.goal.objective() if record is None else record.request.goal
        scene, state = yield _evaluated(scene_survey.survey(scene), record, objective, mounted, names)
        survey, solution = state.placed()
        take_over(scene, survey.site, solution.deployment, labelled_sensors(scene, hidden=True))
        self.report({"INFO"}, answer(keep_result(scene, state))[0])


def _evaluated(
    surveying: Generator[Progress, None, SceneState],
    record: PlacementRecord | None,
    objective: Objective,
    mounted: Sequence[MountedSensor],
    places: Mapping[str, str],
) -> Generator[Progress, None, SceneState]:
    if record is None:
        state, survey = yield from scene_survey.with_visibility((yield from surveying))
    else:
        state, survey = yield from scene_survey.with_grid_of(surveying, record)
    solution = yield from evaluate_moved_sensors(survey, objective, mounted, places)
    return replace(state, solution=solution)


def keep_result(scene: bpy.types.Scene, state: SceneState) -> PlacementRecord:
    """Store the placement whose sensors are in the scene, with all that is needed to go on later; return its record."""
    survey, solution = state.placed()
    provenance = Provenance(datetime.now(UTC), state.durations, versions(blender=bpy.app.version_string))
    record = record_of(survey, solution, provenance)
    live_coverage.stop()
    kept = scene.seip.result
    kept.change = "" if no_placement(scene) else change_text(record, parsed_record(kept.record))
    kept.keep(record.text(), digest(survey.site.targets.xyz), packed_counts(solution.deployment.seen_by))
    bpy.context.window_manager.seip_sections.follow_steps()
    session.of(scene).state = replace(state, record=kept.record)
    return record


class _Writes(ForPlacement, LongWork):
    """Mixin for operators that write the placement into the folder of the result."""

    obstacles = (*ForPlacement.obstacles, no_folder, not_evaluated)


def _checked_folder(scene: bpy.types.Scene) -> Path:
    """Return the folder of the result, which can be written."""
    folder = saved_path(scene.seip.result.folder, "the result")
    check_folder(folder)
    return folder


class SEIP_OT_export_result(_Writes, bpy.types.Operator):
    """Write tables, pictures and the scene with its sensors to the folder, replacing earlier ones"""

    bl_label = "Export"
    stopped_message = "stopped; nothing was written"

    def job(self, scene: bpy.types.Scene) -> Job:
        """Save the scene as it is, find the placement again and write it, and report where the files are."""
        folder = _checked_folder(scene)
        scene, state = yield started(_exported(folder, scene))
        session.of(scene).state = state
        self.report({"INFO"}, f"written to {folder}")


def _exported(folder: Path, scene: bpy.types.Scene) -> Generator[Progress, None, SceneState]:
    """Write a result: the scene before the first report, which is the part that needs Blender's data."""
    render, name = scene.seip.result.render, scene.name
    finding = scene_survey.with_placement(scene)
    if coverage_of(scene) is not None:
        show_seen_by(scene, unpacked_counts(scene.seip.result.seen))  # it may show a comparison, or sensors on the move
    legend = shown_legend(scene)
    tidy_pieces(scene)
    with result_files(folder) as part:
        save_blend(part["placed.blend"])
        save_glb(part["scene.glb"], attribution_of(scene))
        yield Progress(0, 0, "reading the scene")
        state = yield from finding
        survey, solution = state.placed()
        record = parsed_record(state.record)
        record = replace(record, settings={**record.settings, "render": render})
        plans = yield from write_tables(part, survey, solution, record)
        deployment = solution.deployment
        with TemporaryDirectory(prefix="seip-") as raw:
            rendered = None
            if render:
                rendered = yield from render_elsewhere(Path(raw), part["placed.blend"], name, survey.site, deployment)
            write_pictures(part, survey, record, deployment, plans, rendered, legend)
    survey.grid.save(folder / "visibility.npz")
    return state


class SEIP_OT_write_report(_Writes, bpy.types.Operator):
    """Write a report on the placement to the folder, as HTML and PDF; export the placement first if needed"""

    stopped_message = "stopped; no report was written"

    def job(self, scene: bpy.types.Scene) -> Job:
        """Export unless the folder holds this result, write the report, and say where the files are."""
        folder = _checked_folder(scene)
        is_exported = _holds(folder, scene.seip.result.record, _time_of(folder / _RECORD))
        exporting = scene_survey.with_placement(scene) if is_exported else started(_exported(folder, scene))
        scene, (state, written) = yield _reported(folder, exporting)
        session.of(scene).state = state
        self.report({"INFO"}, f"written: {' and '.join(path.name for path in written)} in {written[0].parent}")


def _reported(
    folder: Path, exporting: Generator[Progress, None, SceneState]
) -> Generator[Progress, None, tuple[SceneState, tuple[Path, ...]]]:
    state = yield from exporting
    return state, (yield from write_report(folder))


def exported_files(scene: bpy.types.Scene) -> dict[str, Path]:
    """Return the plan and the report of the present placement, as far as the folder of the result has them."""
    folder = Path(bpy.path.abspath(scene.seip.result.folder))
    written = _time_of(folder / _RECORD)
    if no_folder(scene) or written is None or not _holds(folder, scene.seip.result.record, written):
        return {}
    times = {what: _time_of(folder / name) for what, name in _FILES.items()}
    return {
        what: folder / _FILES[what]
        for what, time in times.items()
        if time is not None and (what == "Plan" or time >= written)  # an older report is on an earlier placement
    }


def _time_of(path: Path) -> int | None:
    """Return when a file was written, in nanoseconds, or None if it is not there."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return None


@lru_cache(maxsize=8)  # a panel asks at every redraw
def _holds(folder: Path, record: str, _written: int | None) -> bool:
    """Return whether a folder holds the export of a placement, whose record was written at the time given."""
    try:
        written = load_placement(folder / _RECORD)
    except SeipError:
        return False
    present = parsed_record(record)
    # The goal is compared too: with other shares of the road users, the same sensors have another value in the files.
    one, other = ((of.sensors, of.inputs, of.notes, of.request.goal) for of in (written, present))
    return one == other
