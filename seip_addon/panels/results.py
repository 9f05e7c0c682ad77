"""The panel of results: sensors, candidates, comparison, files."""

from __future__ import annotations

import bpy

from ..core.errors import SeipError
from ..core.output.results.placement_file import parsed_record
from ..core.output.results.placement_record import PlacementRecord
from ..operators import results
from ..session import FollowedSensors, session
from .run_button import draw_run
from .sidebar import RowList, Sidebar, is_narrow
from .wrapped_text import draw_sentence


class SEIP_UL_chosen(RowList, bpy.types.UIList):
    """The sensors of the placement."""

    bl_idname = "SEIP_UL_chosen"

    def draw_row(self, layout: bpy.types.UILayout, item: bpy.types.PropertyGroup) -> None:
        """Draw a sensor: label, type, height, place and what it sees."""
        record = parsed_record(bpy.context.scene.seip.result.record)
        sensor = next((one for one in record.sensors if one.id == item.name), None)
        if sensor is None:
            layout.label(text=item.name)
            return
        narrow = is_narrow(bpy.context)
        row = layout.split(factor=0.55 if narrow else 0.75)
        where = "" if narrow else f" {sensor.height_m:g} m {sensor.position}"
        row.label(text=f"{item.name}  {sensor.sensor}{where}")
        row.label(text=f"{sensor.coverage_alone:.1%}")


class SEIP_UL_ranked(RowList, bpy.types.UIList):
    """Candidates by their worth."""

    bl_idname = "SEIP_UL_ranked"

    def draw_row(self, layout: bpy.types.UILayout, item: bpy.types.PropertyGroup) -> None:
        """Draw a candidate and its worth."""
        row = layout.split(factor=0.55 if is_narrow(bpy.context) else 0.75)
        row.label(text=item.name)
        row.label(text=f"{item.share:.2%}")


class SEIP_UL_kept(RowList, bpy.types.UIList):
    """Placements that were kept."""

    bl_idname = "SEIP_UL_kept"

    def draw_row(self, layout: bpy.types.UILayout, item: bpy.types.PropertyGroup) -> None:
        """Draw a name that can be changed."""
        layout.prop(item, "name", text="", emboss=False)


class _Result(Sidebar):
    """A mixin: a part of the results, there once there is a placement."""

    bl_parent_id = "SEIP_PT_results"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return whether there is a placement."""
        return not results.no_placement(context.scene)


class SEIP_PT_results(Sidebar, bpy.types.Panel):
    """The placement, sensor by sensor."""

    bl_idname = "SEIP_PT_results"
    bl_label = "Results"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the sensors, and how they are followed when moved."""
        scene, layout = context.scene, self.layout
        sentence = results.no_placement(scene)
        if sentence:
            draw_sentence(layout, sentence, icon="INFO")
            return
        result = scene.seip.result
        layout.template_list(SEIP_UL_chosen.bl_idname, "", result, "sensors", result, "active_sensor", rows=4)
        layout.operator("seip.look_from_sensor", icon="HIDE_OFF")
        if session.following is None:
            draw_run(layout, results.SEIP_OT_follow_sensors.bl_idname, icon="ORIENTATION_GLOBAL")
        else:
            layout.operator("seip.follow_sensors", text="Stop Following", icon="PAUSE", depress=True)
            _draw_followed(layout, session.following)


def _draw_followed(layout: bpy.types.UILayout, following: FollowedSensors) -> None:
    if following.problem:
        draw_sentence(layout, following.problem, icon="ERROR", alert=True)
        return
    layout.label(text=f"Coverage now {following.coverage:.2%}", icon="HIDE_OFF")
    if following.moved:
        draw_sentence(layout, f"Moved by hand: {', '.join(following.moved)}.")


class SEIP_PT_results_candidates(_Result, bpy.types.Panel):
    """Candidates by their worth."""

    bl_idname = "SEIP_PT_results_candidates"
    bl_label = "Candidate Ranking"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the order, the button and the list."""
        result, layout = context.scene.seip.result, self.layout
        layout.row().prop(result, "order", expand=True)
        draw_run(layout, results.SEIP_OT_rank_candidates.bl_idname)
        if result.ranking:
            layout.template_list(SEIP_UL_ranked.bl_idname, "", result, "ranking", result, "active_ranked", rows=5)


class SEIP_PT_results_comparison(_Result, bpy.types.Panel):
    """The present placement beside a kept one."""

    bl_idname = "SEIP_PT_results_comparison"
    bl_label = "Compare"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the kept placements and the comparison."""
        seip, layout = context.scene.seip, self.layout
        row = layout.row()
        row.template_list(SEIP_UL_kept.bl_idname, "", seip, "kept", seip, "active_kept", rows=2)
        column = row.column(align=True)
        column.operator("seip.keep_placement", text="", icon="ADD")
        column.operator("seip.drop_placement", text="", icon="REMOVE")
        if not 0 <= seip.active_kept < len(seip.kept):
            draw_sentence(layout, "Keep this placement with +, place again, and compare the two.", icon="INFO")
            return
        try:
            kept = parsed_record(seip.kept[seip.active_kept].record)
        except SeipError as error:
            draw_sentence(layout, str(error), icon="ERROR")
            return
        _draw_table(layout, kept, parsed_record(seip.result.record))
        layout.operator("seip.show_comparison").back = False
        layout.operator("seip.show_comparison", text="Show Coverage").back = True


def _draw_table(layout: bpy.types.UILayout, kept: PlacementRecord, present: PlacementRecord) -> None:
    grid = layout.grid_flow(row_major=True, columns=3, even_columns=True, align=True)
    for text in ("", "Kept", "Present"):
        grid.label(text=text)
    for name, one, other in (
        ("Coverage", _share(kept.coverage.whole), _share(present.coverage.whole)),
        ("Central", _share(kept.coverage.central), _share(present.coverage.central)),
        ("Price", kept.price_text, present.price_text),
        ("Sensors", str(len(kept.sensors)), str(len(present.sensors))),
    ):
        for text in (name, one, other):
            grid.label(text=text)


def _share(value: float | None) -> str:
    return "–" if value is None else f"{value:.2%}"


class SEIP_PT_results_files(_Result, bpy.types.Panel):
    """The result as files."""

    bl_idname = "SEIP_PT_results_files"
    bl_label = "Export"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw where to, and the button."""
        scene, layout = context.scene, self.layout
        layout.prop(scene.seip.result, "folder", text="")
        layout.prop(scene.seip.result, "render")
        sentence = results.no_folder(scene) or results.not_evaluated(scene)
        if sentence:
            draw_sentence(layout, sentence, icon="INFO")
        draw_run(layout, results.SEIP_OT_export_result.bl_idname, icon="EXPORT")
        draw_run(layout, results.SEIP_OT_write_report.bl_idname, icon="FILE_TEXT")


CLASSES = (
    SEIP_UL_chosen,
    SEIP_UL_ranked,
    SEIP_UL_kept,
    SEIP_PT_results,
    SEIP_PT_results_candidates,
    SEIP_PT_results_comparison,
    SEIP_PT_results_files,
)
