"""The section "Coverage and Sight Lines": what the viewport shows of a placement."""

from __future__ import annotations

import bpy

from ..core.choosing.placement.returns_summary import SURFACE_SEEN
from ..core.output.pictures.coverage_colours import Aspect
from ..operators.results import no_placement
from ..operators.view import (
    SEIP_OT_colour_coverage,
    SEIP_OT_hide_overlay,
    SEIP_OT_show_sight_lines,
    why_no_coverage,
)
from ..scene.write import ASPECT, aspects_of, coverage_of
from ..session import session
from ..viewport import coverage, overlays
from ..viewport.point_cloud import NAME as CLOUD
from ..viewport.sight_lines import NAME as SIGHT
from .run_button import draw_run, is_running
from .wrapped_text import draw_sentence

ASPECTS: dict[Aspect, str] = {"returns": "Returns", "seen": "Seen", "times": "Sensors", "weights": "Weights"}
"""What the buttons of the colours say."""


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw what can be shown."""
    scene = context.scene
    if why_no_coverage(scene) and no_placement(scene) and session.scan_of(scene) is None:
        draw_sentence(layout, "There is nothing to show yet.", icon="INFO")
        return
    _draw_coverage(layout, context)
    _draw_sight(layout, context)
    if session.scan_of(scene) is not None:
        _draw_cloud(layout, context)


def _draw_coverage(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    column = layout.column(align=True)
    head = column.row()
    head.label(text="Coverage")
    head.prop(context.scene.seip.view, "legend", text="", icon="INFO")
    obj = coverage_of(context.scene)
    row = column.row(align=True)
    possible = ASPECTS if obj is None else aspects_of(obj)
    for aspect, words in ASPECTS.items():
        if aspect not in possible:
            continue
        now = obj is not None and obj.get(ASPECT) == aspect
        button = row.operator(SEIP_OT_colour_coverage.bl_idname, text=words, depress=now)
        button.aspect = aspect
    if obj is not None and "returns" in possible and obj.get(ASPECT) in {"seen", "times"}:
        draw_sentence(column, SURFACE_SEEN, icon="INFO")
    why_not = why_no_coverage(context.scene)
    if why_not:
        draw_sentence(column, why_not, icon="INFO")
    elif not coverage.shows_coverage(context.space_data):
        text = "This view's shading does not show the colours: press one of them."
        draw_sentence(column, text, icon="ERROR")


def _draw_sight(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    column = layout.column(align=True)
    column.label(text="Sight Lines")
    overlay = overlays.find(context.scene, SIGHT)
    row = column.row(align=True)
    words = "From Sensor" if overlay is None else overlay.about
    row.operator_menu_enum(SEIP_OT_show_sight_lines.bl_idname, "sensor", text=words, icon="LIGHT_SPOT")
    if overlay is not None:
        row.operator(SEIP_OT_hide_overlay.bl_idname, text="", icon="X").name = SIGHT
    if is_running(SEIP_OT_show_sight_lines.bl_idname):
        draw_run(column, SEIP_OT_show_sight_lines.bl_idname)
    why_not = no_placement(context.scene)
    if why_not:
        draw_sentence(column, why_not, icon="INFO")


def _draw_cloud(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    column = layout.column(align=True)
    column.label(text="Point Cloud")
    column.row(align=True).prop(context.scene.seip.view, "cloud_colour", expand=True)
    column.operator(SEIP_OT_hide_overlay.bl_idname, icon="X").name = CLOUD
