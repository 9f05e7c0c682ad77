"""The section "Results": the placement that the file keeps, its sensors, and comparison with placements before."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from itertools import count

import bpy
from bpy.props import BoolProperty, CollectionProperty, IntProperty, StringProperty
from mathutils import Vector

from ..core.base.errors import SeipError
from ..core.base.progress import Progress
from ..core.choosing.placement.objective import Objective
from ..core.choosing.placement.returns_summary import returns_text
from ..core.output.pictures.palette import compare, packed_counts, unpacked_counts
from ..core.output.results.answer import answer, change_text
from ..core.output.results.placement_record import PlacementRecord, Provenance, parsed_record
from ..core.output.results.versions import versions
from ..core.sensing.lidar.model import short_name
from ..core.sensing.scans.sensor import MountedSensor
from ..core.storage.files import digest
from ..core.workflows.moved_sensors import BY_HAND, evaluate_moved_sensors
from ..core.workflows.records import record_of
from ..scene import contract
from ..scene.sensors import labelled_sensors, placed_sensors, read_sensors
from ..scene.write import aspects_of, coverage_of, recolour, take_over
from . import following, preferences, scene_status
from .coverage import draw_view
from .following import draw_followed
from .layout import RowList, draw_list, draw_reason, draw_run, draw_sections, draw_sentence
from .properties import complaint, path_property
from .scene_status import active_sensor, no_placement, not_evaluated
from .session import SceneState, session
from .survey import read_layout, with_grid_of, with_visibility
from .work import ForPlacement, ForReadyScene, Job, LongWork, ShortWork, select_alone

EYE_DISTANCE = 10.0
"""Metres from a sensor's eye to the point that the view turns about."""
SENSOR_SHARE = 0.72
"""Share of a row of the list that a sensor takes, beside what it sees."""
OTHER_TARGETS = "The two placements were made on different targets: only their figures can be compared."


class SEIP_PG_chosen(bpy.types.PropertyGroup):
    """A sensor of the placement; its name is its label."""


class SEIP_PG_placement(bpy.types.PropertyGroup):
    """Stored placement; the rest is recomputed from the scene and the cached visibility."""

    record: StringProperty(name="Record", description="Placement as in placement.json")
    targets: StringProperty(name="Targets", description="Digest of the placement's targets")
    seen: StringProperty(name="Seen", description="Number of sensors that see each target, packed")


class SEIP_PG_result(SEIP_PG_placement):
    """Current placement and its display settings."""

    change: StringProperty(name="Change", description="Difference from the placement before")
    sensors: CollectionProperty(type=SEIP_PG_chosen)
    active_sensor: IntProperty(
        name="Sensor",
        description="Click to select the sensor in the scene",
        update=select_sensor,
    )
    folder: path_property(
        "Folder", "Folder for the result; // is the folder of the .blend", folder=True, default="//seip-result/"
    )
    report: BoolProperty(
        name="Include Report", description="Write a report on the placement as HTML and PDF as well", default=True
    )
    render: BoolProperty(
        name="Include Rendered View",
        description="Add a rendered view of the scene to the files and the report, which takes a minute",
        default=False,
    )

    def active_label(self) -> str:
        """Return the label of the sensor that is active in the list, or ""."""
        number = self.active_sensor
        return self.sensors[number].name if number in range(len(self.sensors)) else ""

    def keep(self, record: str, targets: str, seen: str) -> None:
        """Keep a placement as the current one, with a row for each of its sensors."""
        self.record, self.targets, self.seen = record, targets, seen
        self.sensors.clear()
        for sensor in parsed_record(record).sensors:
            self.sensors.add().name = sensor.id


def select_sensor(result: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """Select the sensor that was clicked on in the list, and nothing else."""
    empty = placed_sensors(context.scene).get(result.sensors[result.active_sensor].name)
    if empty is None or empty.name not in context.view_layer.objects:
        return
    select_alone(context, empty)


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


def _middle_of_road(scene: bpy.types.Scene) -> Vector:
    """Return the middle of the coverage, or the origin where it is gone."""
    coverage = coverage_of(scene)
    corners = [] if coverage is None else [coverage.matrix_world @ Vector(corner) for corner in coverage.bound_box]
    return sum(corners, Vector()) / len(corners) if corners else Vector()


class SEIP_OT_evaluate_sensors(ForReadyScene, LongWork, bpy.types.Operator):
    """Evaluate the sensors of the scene at their present poses, and make them the placement"""

    obstacles = (
        *ForReadyScene.obstacles,
        lambda scene: "" if scene_status.has_unevaluated(scene) else no_placement(scene),
    )

    def job(self, scene: bpy.types.Scene) -> Job:
        """Evaluate the sensors; those without a placement are evaluated under the goal of the panel."""
        mounted = read_sensors(scene, preferences.catalogue(), hidden=True)
        text, names = scene.seip.result.record, _position_names(scene)
        record = parsed_record(text) if text else None
        objective = scene.seip.goal.objective() if record is None else record.request.goal
        scene, state = yield _evaluated(read_layout(scene), record, objective, mounted, names)
        survey, solution = state.placed()
        take_over(scene, survey.site, solution.deployment, labelled_sensors(scene, hidden=True))
        self.report({"INFO"}, answer(keep_result(scene, state))[0])


def _position_names(scene: bpy.types.Scene) -> dict[str, str]:
    """Return position names by sensor label, for sensors that are not at a candidate pose."""
    sensors = labelled_sensors(scene, hidden=True)
    names = {label: str(sensor.get(contract.POSITION, "")) for label, sensor in sensors.items()}
    return {
        label: name if not name or name.startswith(BY_HAND) else f"{BY_HAND}, from {name}"
        for label, name in names.items()
    }


def _evaluated(
    surveying: Generator[Progress, None, SceneState],
    record: PlacementRecord | None,
    objective: Objective,
    mounted: Sequence[MountedSensor],
    places: Mapping[str, str],
) -> Generator[Progress, None, SceneState]:
    if record is None:
        state, survey = yield from with_visibility((yield from surveying))
    else:
        state, survey = yield from with_grid_of(surveying, record)
    solution = yield from evaluate_moved_sensors(survey, objective, mounted, places)
    return replace(state, solution=solution)


def keep_result(scene: bpy.types.Scene, state: SceneState) -> PlacementRecord:
    """Store the placement whose sensors are in the scene, with all that is needed to go on later; return its record."""
    survey, solution = state.placed()
    provenance = Provenance(datetime.now(UTC), state.durations, versions(blender=bpy.app.version_string))
    record = record_of(survey, solution, provenance)
    following.stop()
    kept = scene.seip.result
    kept.change = "" if no_placement(scene) else change_text(record, parsed_record(kept.record))
    kept.keep(record.text(), digest(survey.site.targets.xyz), packed_counts(solution.deployment.seen_by))
    session.of(scene).state = replace(state, record=kept.record)
    bpy.context.window_manager.seip_sections.follow_steps(scene)
    return record


class SEIP_UL_chosen(RowList, bpy.types.UIList):
    """The sensors of the placement."""

    def draw_row(self, layout: bpy.types.UILayout, item: bpy.types.PropertyGroup) -> None:
        """Draw a sensor: label, height, product if there are several, position, and what it sees."""
        record = parsed_record(bpy.context.scene.seip.result.record)
        sensor = next((one for one in record.sensors if one.id == item.name), None)
        if sensor is None:
            layout.label(text=item.name)
            return
        row = layout.split(factor=SENSOR_SHARE)
        several = len({one.sensor for one in record.sensors}) > 1
        product = [short_name(sensor.sensor_name)] if several else []
        words = [item.name, f"{sensor.height_m:g} m", *product, sensor.position]
        row.label(text="  ".join(words), translate=False)
        row.label(text=f"{sensor.coverage_alone:.1%}")


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


class SEIP_UL_kept(RowList, bpy.types.UIList):
    """Placements that were kept."""

    def draw_row(self, layout: bpy.types.UILayout, item: bpy.types.PropertyGroup) -> None:
        """Draw a name that can be changed."""
        layout.prop(item, "name", text="", emboss=False)


def _returns(record: PlacementRecord) -> str:
    return "–" if record.returns is None else returns_text(record.returns.typical)


def _share(value: float | None) -> str:
    return "–" if value is None else f"{value:.2%}"


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the sensors and how they are followed when moved, then the closed sections."""
    scene = context.scene
    if draw_reason(layout, no_placement(scene)):
        if coverage_of(scene) is not None:
            draw_sections(layout, {"view": draw_view}, context)
        return
    result = scene.seip.result
    heading = layout.split(factor=SENSOR_SHARE)
    heading.label(text="Sensor")
    heading.label(text="Sees Alone")
    draw_list(layout, SEIP_UL_chosen, result, "sensors", "active_sensor")
    text = f"View from {result.active_label() or 'Sensor'}"
    layout.operator("seip.look_from_sensor", icon="HIDE_OFF", text=text)
    if session.following is None:
        draw_run(layout, "seip.follow_sensors", icon="ORIENTATION_GLOBAL")
    else:
        layout.operator("seip.follow_sensors", text="Stop Following", icon="PAUSE", depress=True)
        draw_followed(layout, session.following)
    draw_sections(layout, {"view": draw_view, "comparison": _draw_comparison}, context)


def _draw_comparison(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the kept placements, and the present one beside the active one of them."""
    seip = context.scene.seip
    row = layout.row()
    draw_list(row, SEIP_UL_kept, seip, "kept", "active_kept")
    column = row.column(align=True)
    column.operator("seip.keep_placement", text="", icon="ADD")
    column.operator("seip.remove_entry", text="", icon="REMOVE").of = "KEPT"
    if not 0 <= seip.active_kept < len(seip.kept):
        draw_sentence(layout, "Keep this placement with +, place again, and compare the two.", icon="INFO")
        return
    kept, present = seip.kept[seip.active_kept], seip.result
    if draw_reason(layout, complaint(lambda: parsed_record(kept.record))):
        return
    _draw_table(layout, parsed_record(kept.record), parsed_record(present.record))
    if draw_reason(layout, OTHER_TARGETS if kept.targets != present.targets else ""):
        return
    layout.operator("seip.show_comparison")
    if (obj := coverage_of(context.scene)) is not None:
        layout.operator("seip.colour_coverage", text="Show Coverage").aspect = aspects_of(obj)[0]


def _draw_table(layout: bpy.types.UILayout, kept: PlacementRecord, present: PlacementRecord) -> None:
    grid = layout.grid_flow(row_major=True, columns=3, even_columns=True, align=True)
    for text in ("", "Kept", "Present"):
        grid.label(text=text)
    returns = ("Returns", _returns(kept), _returns(present))
    for name, one, other in (
        *([returns] if kept.returns or present.returns else []),
        ("Road Seen", _share(kept.coverage.whole), _share(present.coverage.whole)),
        ("Central", _share(kept.coverage.central), _share(present.coverage.central)),
        ("Price", kept.price_text, present.price_text),
        ("Sensors", str(len(kept.sensors)), str(len(present.sensors))),
    ):
        for text in (name, one, other):
            grid.label(text=text)
