"""The step "Sensors": the table of products, those to choose from, mounting heights and tilts."""

from __future__ import annotations

import math

import bpy

from ..core.output.results.placement_record import parsed_record
from ..core.sensing.lidar.model import LidarModel
from ..core.sensing.returns.bodies import PANELS
from ..core.sensing.visibility.ring_resolution import unresolved_from
from ..core.sensing.visibility.road_range import road_range, upright_range
from ..core.sensing.visibility.settings import VisibilitySettings
from ..operators.base import Outcome
from ..operators.results import no_placement
from ..scene.materials import REFLECTIVITY
from ..state import sensor_types
from ..state.session import session
from ..viewport import beam_preview, overlays
from .sections import Status, draw_sections
from .sidebar import is_narrow, settings_column
from .wrapped_text import draw_sentence

TABLE_WIDTH, TABLE_MARGIN = 760, 40
"""Width of the table, and of the window beside it, pixels at the usual scale of the interface."""
COLUMNS = (("Sensor", 0.40), ("Channels", 0.11), ("Field of view", 0.14), ("Pedestrian", 0.12), ("Price", 0.11))
"""Titles and shares of the width; the rest shows what the detection law rests on."""


class SEIP_OT_choose_sensors(bpy.types.Operator):
    """Choose the sensors that a placement may use, from a table of all products"""

    bl_idname = "seip.choose_sensors"
    bl_label = "Choose Sensors…"
    bl_options = {"REGISTER", "UNDO"}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> Outcome:
        """Show the table."""
        sensor_types.refresh()
        context.scene.seip.survey.filter = ""
        room = int(context.window.width / context.preferences.system.ui_scale) - TABLE_MARGIN
        outcome: Outcome = context.window_manager.invoke_popup(self, width=min(TABLE_WIDTH, room))
        return outcome

    def execute(self, _context: bpy.types.Context) -> Outcome:
        """Keep the choice, which the table has made."""
        return {"FINISHED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the filter, and a row for each product."""
        survey, layout = context.scene.seip.survey, self.layout
        layout.prop(survey, "filter", text="", icon="VIEWZOOM", placeholder="Manufacturer or product")
        draw_table(layout, survey)
        layout.operator("seip.add_catalogue", icon="ADD")


def draw_table(layout: bpy.types.UILayout, survey: bpy.types.PropertyGroup) -> None:
    """Draw the titles, and a row for each product whose name contains the filter."""
    wanted = survey.filter.casefold()
    shown = [key for key in sensor_types.in_order() if wanted in f"{key} {_title_of(key)}".casefold()]
    _row(layout, None, (*(title for title, _ in COLUMNS), "Detection law"))
    column = layout.column(align=True)
    column.scale_y = 0.85
    for key in shown:
        _row(column, survey.types.get(key), _cells(session.sensor_types[key]))
    if not shown:
        column.label(text="No product has this in its name.", icon="INFO")


def _row(layout: bpy.types.UILayout, item: bpy.types.PropertyGroup | None, cells: tuple[str, ...]) -> None:
    rest, left = layout.row(align=True), 1.0
    for number, text in enumerate(cells):
        if number < len(COLUMNS):
            share = COLUMNS[number][1]
            rest = rest.split(factor=share / left)
            left -= share
        if number == 0 and item is not None:
            rest.prop(item, "use", text=text, translate=False)
        else:
            rest.label(text=text, translate=False)


def _title_of(key: str) -> str:
    return sensor_types.title(session.sensor_types[key])


def _cells(model: LidarModel) -> tuple[str, ...]:
    low, high = math.degrees(model.elevations.min()), math.degrees(model.elevations.max())
    across = math.degrees(model.field_of_view)
    return (
        sensor_types.title(model),
        f"{model.channels}",
        f"{across:.0f}° × {high - low:.0f}°",
        f"{pedestrian_range(model):.0f} m",
        f"${model.price:,.0f}",
        _law(model),
    )


def _law(model: LidarModel) -> str:
    if model.manufacturer == sensor_types.PAPER:
        return "paper's model"
    if model.calibration:
        return "calibrated"
    return "data sheet"


def pedestrian_range(model: LidarModel) -> float:
    """Return the distance in metres up to which a return from a pedestrian is detected with the usual probability."""
    return upright_range(model, PANELS["pedestrian"].reflected, VisibilitySettings())


def status(scene: bpy.types.Scene) -> Status:
    """Return the placed sensors for the header, or the types to choose from and their heights."""
    survey = scene.seip.survey
    used, heights = survey.used_types(), survey.parsed_heights()
    if not no_placement(scene):
        record = parsed_record(scene.seip.result.record)
        names = sorted({sensor.sensor for sensor in record.sensors})
        placed_heights = sorted({sensor.height_m for sensor in record.sensors})
        candidates = record.request.candidates
        changed = (tuple(used), tuple(heights)) != (candidates.sensors, candidates.heights)
        return Status(changed, (f"{len(record.sensors)} × {_names(names)}", f"at {_span(placed_heights)}"))
    if not used:
        return Status(result=("none chosen",))
    return Status(result=(_names(used), f"at {_span(heights)}" if heights else "no valid height"))


def _names(keys: list[str]) -> str:
    model = session.sensor_types.get(keys[0])
    name = keys[0] if model is None else model.name
    return name if len(keys) == 1 else f"{len(keys)} types"


def _span(heights: list[float]) -> str:
    low, high = min(heights), max(heights)
    return f"{low:g} m" if low == high else f"{low:g}–{high:g} m"


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the chosen products, and the heights and tilts at which they may be mounted."""
    survey = context.scene.seip.survey
    if session.catalogue_error:
        draw_sentence(layout, session.catalogue_error, icon="ERROR", alert=True)
    used = survey.used_types()
    column = layout.column(align=True)
    for key in used:
        _draw_product(column, key)
    if not used:
        draw_sentence(column, "Choose at least one sensor.", icon="ERROR", alert=True)
    layout.operator(SEIP_OT_choose_sensors.bl_idname, icon="ADD")
    _draw_mounting(layout, context)
    draw_sections(layout, {"about_sensor": _draw_about, "beams": _draw_beams}, context)


def _draw_product(layout: bpy.types.UILayout, key: str) -> None:
    model = session.sensor_types.get(key)
    row = layout.row(align=True)
    if model is None:
        row.label(text=f"{key}: not in the catalogue", icon="ERROR", translate=False)
    else:
        name = model.name if is_narrow(bpy.context) else sensor_types.title(model)
        row.label(text=name, translate=False)
        price = row.row(align=True)
        price.alignment = "RIGHT"
        price.label(text=f"${model.price:,.0f}", translate=False)
    item = bpy.context.scene.seip.survey.types.get(key)
    if item is not None:
        row.prop(item, "use", text="", icon="X", emboss=False)


def _draw_mounting(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    survey = context.scene.seip.survey
    column = settings_column(layout)
    for name, wrong in (("heights", survey.wrong_heights()), ("tilts", survey.wrong_tilts())):
        row = column.row()
        row.use_property_split = True  # a text has no room for its name within
        row.alert = bool(wrong)
        row.prop(survey, name, text=name.capitalize() if is_narrow(context) else None)
        if wrong:
            draw_sentence(column, wrong, icon="ERROR", alert=True)


def _draw_about(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the figures of a chosen product, and what they rest on."""
    survey = context.scene.seip.survey
    layout.prop_search(survey, "about", survey, "types", text="", icon="VIEWZOOM")
    model = session.sensor_types.get(survey.shown_type())
    if model is None:
        draw_sentence(layout, "Choose a sensor that is in the catalogue.", icon="INFO")
        return
    layout.label(text=sensor_types.title(model), translate=False)
    for what, value in (*_figures(model), *_on_road(model, survey.parsed_heights(), survey.delta)):
        split = layout.split(factor=0.42)
        split.scale_y = 0.8
        split.label(text=what)
        split.label(text=value)
    draw_sentence(layout, f"Detection: {model.evidence}")
    draw_sentence(layout, f"Figures: {model.source}")
    if model.assumed:
        draw_sentence(layout, f"Assumed: {model.assumed}")
    draw_sentence(layout, f"Price: {model.price_source or 'no source'}")


def _on_road(model: LidarModel, heights: list[float], delta: float) -> list[tuple[str, str]]:
    """Return the range on the road, and where the rings of the beams begin to leave gaps, for the greatest height."""
    if not heights:
        return []
    height = max(heights)
    far = road_range(model, REFLECTIVITY["asphalt"], height, VisibilitySettings())
    across = math.sqrt(max(model.max_range**2 - height**2, 0.0))
    dense = unresolved_from(model, height, delta, across)
    lines = [("Height", f"{height:g} m"), ("On dry asphalt", f"up to {far:.0f} m")]
    if dense < across:
        lines.append(("Rings close", f"up to {dense:.0f} m, then gaps"))
    return lines


def _figures(model: LidarModel) -> list[tuple[str, str]]:
    low, high = math.degrees(model.elevations.min()), math.degrees(model.elevations.max())
    cheap, dear = model.price_range
    return [
        ("Channels", f"{model.channels}"),
        ("Elevations", f"{low:.4g}…{high:.4g}°"),
        ("Range", f"{model.min_range:g}…{model.max_range:g} m"),
        ("On a pedestrian", f"up to {pedestrian_range(model):.0f} m"),
        ("Points", f"{model.points_per_second:,.0f} /s"),
        ("Rotation", f"{model.rotation_rate:g} Hz"),
        ("Azimuth", f"{math.degrees(model.azimuth_step):.2g}°"),
        ("Field of view", f"{math.degrees(model.field_of_view):.4g}°"),
        ("Price", f"${cheap:,.0f}" if cheap == dear else f"${cheap:,.0f}…{dear:,.0f}"),
    ]


def _draw_beams(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the button; the legend in the view says what the colours of the rings mean."""
    shown = overlays.find(context.scene, beam_preview.NAME) is not None
    settings_column(layout).prop(context.scene.seip.survey, "preview_height")
    text = "Hide Beams" if shown else "Show Beams"
    layout.operator("seip.preview_beams", text=text, icon="LIGHT_SPOT", depress=shown)
