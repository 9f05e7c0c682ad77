"""The table of sensors to choose from, by manufacturer and product."""

from __future__ import annotations

import math

import bpy

from .. import sensor_types
from ..core.sensing.lidar.model import LidarModel
from ..core.sensing.returns.bodies import PANELS
from ..core.sensing.visibility.road_range import upright_range
from ..core.sensing.visibility.settings import VisibilitySettings
from ..operators.base import Outcome
from ..operators.sensors import SEIP_OT_add_catalogue
from ..session import session

WIDTH = 760
"""Width of the table, pixels at the usual scale of the interface."""
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
        outcome: Outcome = context.window_manager.invoke_popup(self, width=WIDTH)
        return outcome

    def execute(self, _context: bpy.types.Context) -> Outcome:
        """Keep the choice, which the table has made."""
        return {"FINISHED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the filter, and a row for each product."""
        survey, layout = context.scene.seip.survey, self.layout
        layout.prop(survey, "filter", text="", icon="VIEWZOOM", placeholder="Manufacturer or product")
        draw_table(layout, survey)
        layout.operator(SEIP_OT_add_catalogue.bl_idname, icon="ADD")


def draw_table(layout: bpy.types.UILayout, survey: bpy.types.PropertyGroup) -> None:
    """Draw the titles, and a row for each product whose name contains the filter."""
    wanted = survey.filter.casefold()
    shown = [key for key in sensor_types.in_order() if wanted in f"{key} {_title(key)}".casefold()]
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


def _title(key: str) -> str:
    return sensor_types.title(session.sensor_types[key])


def _cells(model: LidarModel) -> tuple[str, ...]:
    low, high = math.degrees(model.elevations.min()), math.degrees(model.elevations.max())
    across = math.degrees(model.field_of_view)
    return (
        sensor_types.title(model),
        "rosette" if model.rosette is not None else f"{model.channels}",
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


CLASSES = (SEIP_OT_choose_sensors,)
