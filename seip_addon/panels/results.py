"""The section "Results": placed sensors, coverage colours and sight lines, comparison."""

from __future__ import annotations

import bpy

from ..core.choosing.placement.returns_summary import SURFACE_SEEN, returns_text
from ..core.output.results.placement_record import PlacementRecord, parsed_record
from ..core.sensing.lidar.model import short_name
from ..operators import results
from ..operators.results import no_placement
from ..operators.view import ASPECTS, why_no_coverage
from ..properties.conversion import complaint
from ..scene.write import ASPECT, aspects_of, coverage_of
from ..state.sensor_edits import sensor_edits
from ..state.session import FollowedSensors, session
from ..viewport import coverage, last_scan, overlays
from ..viewport.sight_lines import NAME as SIGHT
from . import placement
from .sections import Status, draw_sections
from .sidebar import RowList, draw_reason, draw_run
from .wrapped_text import draw_sentence

SENSOR_SHARE = 0.72
"""Share of a row of the list that a sensor takes, beside what it sees."""


def draw_view(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw what can be shown."""
    scene = context.scene
    nothing = why_no_coverage(scene) and no_placement(scene) and session.of(scene).scan is None
    if draw_reason(layout, "There is nothing to show yet." if nothing else ""):
        return
    _draw_coverage(layout, context)
    _draw_sight(layout, context)
    if session.of(scene).scan is not None:
        _draw_cloud(layout, context)


def _draw_coverage(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    column = layout.column(align=True)
    head = column.row()
    head.label(text="Coverage")
    head.prop(context.scene.seip.view, "legend", text="", icon="INFO")
    obj = coverage_of(context.scene)
    row = column.row(align=True)
    possible = tuple(aspect for aspect, _, _ in ASPECTS) if obj is None else aspects_of(obj)
    for aspect, words, _ in ASPECTS:
        if aspect in possible:
            now = obj is not None and obj.get(ASPECT) == aspect
            row.operator("seip.colour_coverage", text=words, depress=now).aspect = aspect
    if obj is not None and "returns" in possible and obj.get(ASPECT) in {"seen", "times"}:
        draw_sentence(column, SURFACE_SEEN, icon="INFO")
    if not draw_reason(column, why_no_coverage(context.scene)) and not coverage.shows_coverage(context.space_data):
        text = "This view's shading does not show the colours: press one of them."
        draw_sentence(column, text, icon="ERROR")


def _draw_sight(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    column = layout.column(align=True)
    column.label(text="Sight Lines")
    overlay = overlays.find(context.scene, SIGHT)
    row = column.row(align=True)
    label = context.scene.seip.result.active_label() or "Sensor"
    draw_run(row, "seip.show_sight_lines", icon="LIGHT_SPOT", text=f"From {label}", in_one_row=True)
    if overlay is not None:
        row.operator("seip.hide_overlay", text="", icon="X").name = SIGHT
    draw_reason(column, no_placement(context.scene))


def _draw_cloud(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    column = layout.column(align=True)
    column.label(text="Point Cloud")
    column.row(align=True).prop(context.scene.seip.view, "cloud_colour", expand=True)
    column.operator("seip.hide_overlay", icon="X").name = last_scan.NAME


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


class SEIP_UL_kept(RowList, bpy.types.UIList):
    """Placements that were kept."""

    def draw_row(self, layout: bpy.types.UILayout, item: bpy.types.PropertyGroup) -> None:
        """Draw a name that can be changed."""
        layout.prop(item, "name", text="", emboss=False)


def status(scene: bpy.types.Scene) -> Status:
    """Return whether the placement is out of date."""
    return Status(not results.no_placement(scene) and placement.is_changed(scene))


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
    _draw_list(layout, SEIP_UL_chosen, result, "sensors", "active_sensor")
    text = f"View from {result.active_label() or 'Sensor'}"
    layout.operator("seip.look_from_sensor", icon="HIDE_OFF", text=text)
    if session.following is None:
        draw_run(layout, "seip.follow_sensors", icon="ORIENTATION_GLOBAL")
    else:
        layout.operator("seip.follow_sensors", text="Stop Following", icon="PAUSE", depress=True)
        _draw_followed(layout, session.following)
    draw_sections(layout, {"view": draw_view, "comparison": _draw_comparison}, context)


def _draw_list(
    layout: bpy.types.UILayout, kind: type[bpy.types.UIList], owner: bpy.types.PropertyGroup, items: str, active: str
) -> None:
    """Draw a list with all its rows: a list that scrolls would take the mouse wheel from the sidebar."""
    rows = max(1, len(getattr(owner, items)))
    layout.template_list(kind.__name__, "", owner, items, owner, active, rows=rows, maxrows=rows)


def _draw_followed(layout: bpy.types.UILayout, following: FollowedSensors) -> None:
    if following.problem:
        draw_sentence(layout, following.problem, icon="ERROR", alert=True)
        return
    layout.label(text=_followed_text(following), icon="HIDE_OFF")
    if edits := sensor_edits(bpy.context.scene).describe():
        draw_sentence(layout, edits)


def _followed_text(following: FollowedSensors) -> str:
    """Return the quality of the placement and of the sensors as they are now, by what the placement was chosen for."""
    _, solution = following.state.placed()
    placed = solution.deployment
    if placed.returns is None or following.summary is None:
        before, now, what = f"{placed.coverage:.1%}", f"{following.coverage:.1%}", "of the road"
    else:
        before, now = returns_text(placed.returns.typical), returns_text(following.summary.typical)
        what = "returns"
    return f"{now} {what}" if before == now else f"{before} → {now} {what}"


def _draw_comparison(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the kept placements, and the present one beside the active one of them."""
    seip = context.scene.seip
    row = layout.row()
    _draw_list(row, SEIP_UL_kept, seip, "kept", "active_kept")
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
    if draw_reason(layout, results.OTHER_TARGETS if kept.targets != present.targets else ""):
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


def _returns(record: PlacementRecord) -> str:
    return "–" if record.returns is None else returns_text(record.returns.typical)


def _share(value: float | None) -> str:
    return "–" if value is None else f"{value:.2%}"
