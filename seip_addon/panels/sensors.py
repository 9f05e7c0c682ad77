"""The panel of the sensors: which types to choose from, at which heights, how far tilted and turned."""

from __future__ import annotations

import math

import bpy

from ..core.sensing.lidar.model import LidarModel
from ..core.sensing.visibility.road_range import road_range
from ..core.sensing.visibility.settings import VisibilitySettings
from ..operators.sensors import (
    SEIP_MT_survey_presets,
    SEIP_OT_add_catalogue,
    SEIP_OT_add_survey_preset,
    SEIP_OT_list_sensor_types,
    SEIP_OT_preview_beams,
)
from ..scene.materials import REFLECTIVITY
from ..session import session
from ..viewport import beam_preview
from .sidebar import RowList, Sidebar, is_narrow, settings_column
from .wrapped_text import draw_sentence


class SEIP_UL_sensor_types(RowList, bpy.types.UIList):
    """Sensor types of the catalogue."""

    bl_idname = "SEIP_UL_sensor_types"

    def draw_row(self, layout: bpy.types.UILayout, item: bpy.types.PropertyGroup) -> None:
        """Draw whether a type is used, its key, and its main figures."""
        model = session.sensor_types.get(item.name)
        row = layout.row(align=True)
        row.prop(item, "use", text="")
        if is_narrow(bpy.context):  # the figures are under Details as well
            row.label(text=item.name, icon="NONE" if model else "ERROR", translate=False)
            return
        split = row.split(factor=0.38)
        split.label(text=item.name, icon="NONE" if model else "ERROR", translate=False)
        split.label(text=_in_short(model) if model else "unknown", translate=False)


def _in_short(model: LidarModel) -> str:
    beams = model.channels if model.rosette is None else "rosette"
    return f"{beams} · {model.max_range:g} m · ${model.price / 1000:,.3g}k"


class SEIP_PT_sensors(Sidebar, bpy.types.Panel):
    """Panel: sensor types to choose from."""

    bl_idname = "SEIP_PT_sensors"
    bl_label = "Sensors"

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        """Draw the presets."""
        row = self.layout.row(align=True)
        row.menu(SEIP_MT_survey_presets.__name__, text="", icon="PRESET")
        row.operator(SEIP_OT_add_survey_preset.bl_idname, text="", icon="ADD")
        row.operator(SEIP_OT_add_survey_preset.bl_idname, text="", icon="REMOVE").remove_active = True
        row.separator()

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the list, the heights, the tilts and the yaws."""
        survey = context.scene.seip.survey
        layout = self.layout
        if session.catalogue_error:
            draw_sentence(layout, session.catalogue_error, icon="ERROR", alert=True)
        if not len(survey.types):
            draw_sentence(layout, "Types 1 to 3 of the study are used.", icon="INFO")
            layout.operator(SEIP_OT_list_sensor_types.bl_idname, text="Choose Types")
        else:
            if not is_narrow(context):
                draw_sentence(layout, "Channels · range · middle price")
            layout.template_list(SEIP_UL_sensor_types.bl_idname, "", survey, "types", survey, "active_type", rows=5)
            row = layout.row(align=True)
            row.operator(SEIP_OT_add_catalogue.bl_idname, icon="ADD")
            row.operator(SEIP_OT_list_sensor_types.bl_idname, text="", icon="FILE_REFRESH")
            if not any(one.use for one in survey.types):
                draw_sentence(layout, "Use at least one type.", icon="ERROR", alert=True)
        column = settings_column(layout)
        for name, wrong in (("heights", survey.wrong_heights()), ("tilts", survey.wrong_tilts())):
            row = column.row()
            row.use_property_split = True  # a text has no room for its name within
            row.alert = bool(wrong)
            row.prop(survey, name, text=name.capitalize() if is_narrow(context) else None)
            if wrong:
                draw_sentence(column, wrong, icon="ERROR", alert=True)
        if any(one.use and _looks_one_way(one.name) for one in survey.types):
            column.prop(survey, "yaws")


def _looks_one_way(key: str) -> bool:
    model = session.sensor_types.get(key)
    return model is not None and not model.all_round


class SEIP_PT_sensor_details(Sidebar, bpy.types.Panel):
    """Panel: properties of the active sensor type."""

    bl_idname = "SEIP_PT_sensor_details"
    bl_parent_id = "SEIP_PT_sensors"
    bl_label = "Details"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw its figures and where they are from."""
        survey = context.scene.seip.survey
        if not 0 <= survey.active_type < len(survey.types):
            self.layout.label(text="No type is selected")
            return
        key = survey.types[survey.active_type].name
        model = session.sensor_types.get(key)
        if model is None:
            draw_sentence(self.layout, f"{key} is not in the catalogue: add the file that has it, or do not use it.")
            return
        draw_sentence(self.layout, f"{model.manufacturer} {model.name}")
        height = survey.preview_height
        far = road_range(model, REFLECTIVITY["asphalt"], height, VisibilitySettings(detection=survey.detection))
        for what, value in (*_figures(model), ("On asphalt", f"{far:.0f} m from {height:g} m height")):
            split = self.layout.split(factor=0.42)
            split.scale_y = 0.8
            split.label(text=what)
            split.label(text=value)
        draw_sentence(self.layout, f"Detection: {model.evidence}")
        draw_sentence(self.layout, f"Figures: {model.source}")
        if model.assumed:
            draw_sentence(self.layout, f"Assumed: {model.assumed}")
        draw_sentence(self.layout, f"Price: {model.price_source or 'no source'}")


def _figures(model: LidarModel) -> list[tuple[str, str]]:
    low, high = math.degrees(model.elevations.min()), math.degrees(model.elevations.max())
    cheap, dear = model.price_range
    reach = [
        ("Range", f"{model.min_range:g}…{model.max_range:g} m"),
        ("Points", f"{model.points_per_second:,.0f} /s"),
    ]
    if model.rosette is None:
        beams = [
            ("Channels", f"{model.channels}"),
            ("Elevations", f"{low:.4g}…{high:.4g}°"),
            *reach,
            ("Rotation", f"{model.rotation_rate:g} Hz"),
            ("Azimuth", f"{math.degrees(model.azimuth_step):.2g}°"),
        ]
    else:
        beams = [("Pattern", "rosette"), *reach, ("Accumulated", f"{1 / model.rotation_rate:g} s")]
    return [
        *beams,
        ("Field of view", f"{math.degrees(model.field_of_view):.4g}°"),
        ("Price", f"${cheap:,.0f}" if cheap == dear else f"${cheap:,.0f}–{dear:,.0f}"),
    ]


class SEIP_PT_beam_preview(Sidebar, bpy.types.Panel):
    """The active type's beams in the viewport."""

    bl_idname = "SEIP_PT_beam_preview"
    bl_parent_id = "SEIP_PT_sensors"
    bl_label = "Beam Preview"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the button and what the colours mean."""
        shown = beam_preview.is_shown()
        layout = self.layout
        column = settings_column(layout)
        column.prop(context.scene.seip.survey, "preview_height")
        text = "Hide Beams" if shown else "Show Beams"
        layout.operator(SEIP_OT_preview_beams.bl_idname, text=text, icon="LIGHT_SPOT", depress=shown)
        preview = beam_preview.preview_of(context) if shown else None
        if preview is None:
            return
        draw_sentence(layout, f"{preview.model.key} at {preview.height:.3g} m")
        far = f"{preview.resolved_to():.0f} m"
        if preview.model.rosette is not None:
            near = f"all road in view is within δ = {preview.delta:.3g} m of a ray of the frame"
            apart = "gaps; road in them goes unseen"
            border = f"On a level road there is no gap up to {far}."
        else:
            near = f"within 2δ = {2 * preview.delta:.3g} m of the next ring inwards"
            apart = "farther apart; road between may go unseen"
            border = f"On a level road all{' before it' if preview.tilt else ''} is within 2δ up to {far}."
        draw_sentence(layout, f"Blue: {near}", icon="COLORSET_04_VEC")
        draw_sentence(layout, f"Orange: {apart}", icon="COLORSET_02_VEC")
        draw_sentence(layout, border)


CLASSES = (SEIP_UL_sensor_types, SEIP_PT_sensors, SEIP_PT_sensor_details, SEIP_PT_beam_preview)
