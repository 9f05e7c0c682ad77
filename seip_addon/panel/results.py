"""The section "Results": the placement that the file keeps, its sensors, and their evaluation where they stand."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime

import bpy
from bpy.props import BoolProperty, CollectionProperty, IntProperty, StringProperty
from mathutils import Vector

from ..core.base.errors import SeipError
from ..core.base.progress import Progress
from ..core.choosing.placement.objective import Objective
from ..core.output.pictures.colours import packed_counts
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
from ..scene.write import coverage_of, take_over
from . import following, preferences, scene_status
from .comparison import draw_comparison
from .coverage import draw_view
from .following import draw_followed
from .layout import RowList, draw_list, draw_reason, draw_run, draw_sections
from .properties import path_property
from .scene_status import active_sensor, no_placement
from .session import SceneState, session
from .survey import read_layout, with_grid_of, with_visibility
from .work import ForPlacement, ForReadyScene, Job, LongWork, ShortWork, select_alone

EYE_DISTANCE = 10.0
"""Metres from a sensor's eye to the point that the view turns about."""
SENSOR_SHARE = 0.72
"""Share of a row of the list that a sensor takes, beside what it sees."""


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
    draw_sections(layout, {"view": draw_view, "comparison": draw_comparison}, context)
