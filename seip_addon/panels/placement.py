"""The panel of the placement."""

from __future__ import annotations

from pathlib import Path

import bpy

from .. import scene_status
from ..core.choosing.placement.objective import certificate, purpose
from ..core.choosing.placement.returns_summary import returns_text
from ..core.output.results.placement_file import parsed_record
from ..core.output.results.placement_record import PlacementRecord, relevant_warnings
from ..core.workflows.traffic_runs import traffic_folder
from ..operators.placement import SEIP_OT_solve_placement
from ..operators.results import SEIP_OT_evaluate_sensors, no_placement
from ..operators.visibility import SEIP_OT_compare_scene
from ..sensor_edits import sensor_edits
from .run_button import draw_run
from .sidebar import OfSite, RowList, Sidebar, is_narrow, settings_column
from .wrapped_text import draw_sentence

_SHOWN = {
    "nominal": ("failures", "seen_by"),
    "pose-errors": ("risk", "position_error", "tilt_error", "failures", "seen_by"),
    "traffic": ("risk", "weights_from_traffic", "instants", "held_out"),
}
"""Properties of the objective that are shown for each kind of scenarios."""


class SEIP_UL_rules(RowList, bpy.types.UIList):
    """Positions with a demand of their own."""

    bl_idname = "SEIP_UL_rules"

    def draw_row(self, layout: bpy.types.UILayout, item: bpy.types.PropertyGroup) -> None:
        """Draw a position and what must be there."""
        row = layout.row()
        row.label(text=item.name, icon="CHECKMARK" if item.rule == "MANDATORY" else "CANCEL")
        row.prop(item, "rule", text="")


class SEIP_PT_placement(Sidebar, bpy.types.Panel):
    """Panel: choice of the sensors."""

    bl_idname = "SEIP_PT_placement"
    bl_label = "Placement"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the goal and the button."""
        scene = context.scene
        if scene_status.has_nothing(scene):
            draw_sentence(self.layout, scene_status.NO_SITE, icon="INFO")
            return
        goal = scene.seip.goal
        layout = settings_column(self.layout)
        row = layout.row()
        row.use_property_split = False  # else there is no room for three words
        if is_narrow(context):
            row.prop(goal, "limit", text="")
        else:
            row.prop(goal, "limit", expand=True)  # an empty text would leave each segment without its name
        column = layout.column()
        column.prop(goal, goal.limit.lower())
        row = column.row()
        row.use_property_split = True  # a list has no room for its name within
        row.prop(goal, "weighting")
        if goal.weighting == "VALUE":
            column.prop(goal, "central_weight")
        column.prop(goal, "min_distance")
        draw_run(layout, SEIP_OT_solve_placement.bl_idname)
        obstacle = scene_status.obstacle(scene)
        if obstacle:
            draw_sentence(layout, obstacle, icon="ERROR")
        if not no_placement(scene):
            _draw_answer(layout, scene)


class SEIP_PT_placement_objective(OfSite, bpy.types.Panel):
    """Panel: criterion, scenarios and risk measure."""

    bl_idname = "SEIP_PT_placement_objective"
    bl_parent_id = "SEIP_PT_placement"
    bl_label = "Criterion and Scenarios"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the criterion and the settings of the chosen scenarios."""
        goal = context.scene.seip.goal
        layout = settings_column(self.layout)
        layout.prop(goal, "criterion")
        layout.prop(goal, "scenarios")
        if goal.scenarios == "traffic":
            layout.prop(goal, "runs", placeholder=traffic_folder(Path(bpy.data.filepath)).name)
        for name in _SHOWN[goal.scenarios]:
            layout.prop(goal, name)
        if goal.scenarios == "nominal" or goal.risk == "none":
            return
        number = f"{goal.instants} instants" if goal.scenarios == "traffic" else "twenty draws"
        draw_sentence(layout, f"Rays are cast from every candidate in {number}, which takes minutes.", icon="INFO")


class SEIP_PT_placement_rules(OfSite, bpy.types.Panel):
    """Positions that must, and must not, carry a sensor."""

    bl_idname = "SEIP_PT_placement_rules"
    bl_parent_id = "SEIP_PT_placement"
    bl_label = "Position Rules"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the list, and what adds to it."""
        goal = context.scene.seip.goal
        layout = self.layout
        row = layout.row()
        row.template_list(SEIP_UL_rules.bl_idname, "", goal, "rules", goal, "active_rule", rows=3)
        row.operator("seip.remove_rule", text="", icon="REMOVE")
        layout.prop(goal, "position", text="", icon="VIEWZOOM", placeholder="Position, or the selected pole")
        row = layout.row(align=True)
        row.operator("seip.add_rule", text="Sensor", icon="CHECKMARK").rule = "MANDATORY"
        row.operator("seip.add_rule", text="No Sensor", icon="CANCEL").rule = "FORBIDDEN"


class SEIP_PT_placement_solver(OfSite, bpy.types.Panel):
    """How a placement is searched."""

    bl_idname = "SEIP_PT_placement_solver"
    bl_parent_id = "SEIP_PT_placement"
    bl_label = "Solver"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the solver and its time."""
        layout = settings_column(self.layout)
        layout.prop(context.scene.seip.survey, "solver")
        limits = layout.column(align=True)
        row = limits.row(align=True)
        row.active = context.scene.seip.survey.time_limit == 0
        row.prop(context.scene.seip.survey, "effort")
        limits.prop(context.scene.seip.survey, "time_limit")


def _draw_answer(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw what a placement is worth; what is proven of it as long as it is of the scene as it is, and no longer."""
    record = parsed_record(scene.seip.result.record)
    doubt, by_hand = scene_status.stale_placement(scene), sensor_edits(scene).describe()
    box = layout.box()
    for sentence in (doubt, by_hand):
        if sentence:
            draw_sentence(box, sentence, icon="ERROR")
    if doubt and doubt != scene_status.ANOTHER_SITE:
        draw_run(box, SEIP_OT_compare_scene.bl_idname)
    if by_hand:
        draw_run(box, SEIP_OT_evaluate_sensors.bl_idname)
    column = box.column(align=True)
    column.active = not (doubt or by_hand)
    for name, value in figures(record):
        row = column.split(factor=0.5)
        row.label(text=name)
        row.label(text=value)
    if column.active:
        objective, notes_of_it = record.objective, record.notes
        sentence = certificate(objective.status, objective.gap, cheapest=objective.cheapest, notes=notes_of_it)
        proven = objective.status == "optimal" and not purpose(notes_of_it)  # of the coverage that is shown above
        draw_sentence(box, sentence, icon="CHECKMARK" if proven else "INFO")
    notes = box.column()
    notes.active = column.active
    for note in (*record.notes, *_warnings(record)):
        draw_sentence(notes, note, icon="INFO")


def figures(record: PlacementRecord) -> list[tuple[str, str]]:
    """Return what a placement is evaluated by, as text."""
    coverage, objective = record.coverage, record.objective
    of_each = {} if record.returns is None else record.returns.of_each
    lines = [(f"Returns, {name}", returns_text(number)) for name, number in of_each.items()]
    lines.append(("Coverage", f"{coverage.whole:.2%}"))
    if coverage.gain_band is not None and coverage.gain_band.sheets:
        lines.append(("Over plausible gains", f"{coverage.gain_band.low:.0%} to {coverage.gain_band.high:.0%}"))
    if coverage.central is not None:
        lines.append(("Central", f"{coverage.central:.2%}"))
    if objective.kind == "weighted":
        lines.append(("Weighted", f"{coverage.weighted:.2%}"))
    lines += [("Price", record.price_text), ("Sensors", str(len(record.sensors)))]
    if objective.bound is not None and objective.gap is not None:
        unit = "${:,.0f}" if objective.cheapest else "{:,.6g}"
        lines.append(("Objective", unit.format(objective.value)))
        lines.append(("Bound", unit.format(objective.bound)))
        lines.append(("Gap", f"{objective.gap:.2%}"))
    return lines


def _warnings(record: PlacementRecord) -> list[str]:
    chosen = [sensor.sensor for sensor in record.sensors]
    return relevant_warnings(record.warnings, record.request.candidates.sensors, chosen)


CLASSES = (
    SEIP_UL_rules,
    SEIP_PT_placement,
    SEIP_PT_placement_objective,
    SEIP_PT_placement_rules,
    SEIP_PT_placement_solver,
)
