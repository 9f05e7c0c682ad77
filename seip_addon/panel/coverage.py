"""The coverage on the road: its colours and legend, labels of sensors, and sight lines of one sensor."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty
from numpy.typing import NDArray

from ..core.base.arrays import Float
from ..core.base.errors import SeipError
from ..core.choosing.placement.returns_summary import SURFACE_SEEN
from ..core.output.pictures.palette import (
    FORBIDDEN_VEIL,
    HIDDEN_COLOUR,
    MANDATORY_VEIL,
    MISSED_COLOUR,
    SIGHT_LINE,
    WEIGHTED_VEIL,
    rgb,
)
from ..core.sensing.visibility.sight_lines import SightLines, pose_at, sight_lines
from ..scene import contract
from ..scene.sensors import placed_sensors, pose_of
from ..scene.write import ASPECT, LIFT, aspects_of, colour_coverage, coverage_of, shown_legend
from . import overlays, scans
from .layout import draw_reason, draw_run, draw_sentence
from .legend import Block, Colour, Entry, Label
from .overlays import Layer, Overlay
from .scene_status import active_sensor, no_placement
from .session import session
from .survey import with_placement
from .work import ForPlacement, Job, LongWork, ShortWork

NAME = "coverage"
AREAS = (
    (contract.WEIGHTED_REGIONS, "weighted region", WEIGHTED_VEIL),
    (contract.FORBIDDEN_AREAS, "no sensor allowed", FORBIDDEN_VEIL),
    (contract.MANDATORY_AREAS, "sensor required", MANDATORY_VEIL),
)
"""Collections of areas with their words and colours in the legend."""
SHOWN_BY = {"MATERIAL", "VERTEX"}  # ways to colour Solid shading that show the coverage
ASPECTS = (
    ("returns", "Returns", "Expected returns from a pedestrian, if sensors were placed for returns"),
    ("seen", "Seen", "Road surface that some sensor measures"),
    ("times", "Sensors", "Number of sensors that measure the road surface"),
    ("weights", "Weights", "Weight of each part of the road, if regions are weighted"),
)
"""Meanings of the road's colours, with their names and descriptions."""
NO_COVERAGE = "There is no coverage to show: place sensors first."
SIGHT_LINES = "sight lines"
LINES: Colour = (*rgb(SIGHT_LINE), 0.30)
HIDDEN: Colour = (*rgb(HIDDEN_COLOUR), 0.80)
MISSED: Colour = (*rgb(MISSED_COLOUR), 0.80)
ABOVE = LIFT + 0.02  # metres of the squares over the road: on the coverage, not in it


def update(scene: bpy.types.Scene) -> None:
    """Show the legend where the scene wants one and has coverage, otherwise none."""
    if scene.seip.view.legend and coverage_of(scene) is not None:
        overlays.show(scene, NAME, Overlay((), legend_of_coverage, labels=labels_of_sensors))
    else:
        overlays.hide(scene, NAME)


def show_colours(scene: bpy.types.Scene) -> None:
    """Show a scene's coverage with its legend, in all views of Solid shading."""
    scene.seip.view.legend = True
    windows = (window for window in bpy.context.window_manager.windows if window.scene == scene)
    for view in (area.spaces.active for area in overlays.viewports(windows)):
        if view.shading.type == "SOLID" and not shows_coverage(view):
            set_shading(view)


def legend_of_coverage(scene: bpy.types.Scene) -> Block | None:
    """Return the block of the legend for a scene's coverage, None where there is none."""
    legend = shown_legend(scene)
    if legend is None:
        return None
    rows = zip(legend.words, legend.colours, legend.shares, strict=True)
    entries = tuple(Entry(f"{words}  {share:.1%}", (rgb(colour),)) for words, colour, share in rows)
    return Block(legend.title, (*entries, *_areas(scene)))


def _areas(scene: bpy.types.Scene) -> Iterator[Entry]:
    """Yield an entry for each kind of area that the scene shows on the road or beside it."""
    layer = scene.view_layers[0]
    for name, words, colour in AREAS:
        collection = contract.find(scene, name)
        objects = () if collection is None else collection.all_objects
        if any(obj.visible_get(view_layer=layer) for obj in objects if obj.name in layer.objects):
            yield Entry(words, (rgb(colour),))


def shows_coverage(space: bpy.types.SpaceView3D) -> bool:
    """Return whether a view's shading shows the colours of the coverage."""
    shading = space.shading
    return shading.type in {"MATERIAL", "RENDERED"} or (shading.type == "SOLID" and shading.color_type in SHOWN_BY)


def set_shading(space: bpy.types.SpaceView3D) -> None:
    """Set a view's shading so that it shows the colours of the coverage."""
    space.shading.type = "SOLID"
    space.shading.color_type = "MATERIAL"


def labels_of_sensors(scene: bpy.types.Scene) -> list[Label]:
    """Return the label and product of each sensor that the scene shows, at its optical centre."""
    return [
        (f"{label}  {_product(obj)}".strip(), tuple(obj.matrix_world.translation))
        for label, obj in placed_sensors(scene).items()
        if obj.name in scene.view_layers[0].objects and obj.visible_get(view_layer=scene.view_layers[0])
    ]


def _product(obj: bpy.types.Object) -> str:
    key = str(obj.get(contract.SENSOR, ""))
    model = session.sensor_types.get(key)
    return key if model is None else model.short_name


def _recolour(own: bpy.types.PropertyGroup, _context: object) -> None:
    scans.recolour_cloud(own.id_data)


def _show_legend(own: bpy.types.PropertyGroup, _context: object) -> None:
    update(own.id_data)


class SEIP_PG_view(bpy.types.PropertyGroup):
    """Display settings of the results."""

    legend: BoolProperty(
        name="Legend",
        description="Show the legend of the coverage colours, and the sensors' labels",
        default=True,
        update=_show_legend,
    )
    cloud_colour: EnumProperty(
        name="Point Colours",
        description="Meaning of the point cloud's colours",
        items=(
            ("sensor", "Sensor", "Sensor that measured the point"),
            ("intensity", "Intensity", "Intensity of the return"),
            ("instance", "Road User", "Road user that the point is on"),
        ),
        update=_recolour,
    )


def why_no_coverage(scene: bpy.types.Scene) -> str:
    """Return why coverage cannot be coloured, or ""."""
    return NO_COVERAGE if coverage_of(scene) is None else ""


class SEIP_OT_colour_coverage(ShortWork, bpy.types.Operator):
    """Colour the coverage on the road, with a legend; a Solid view is set to show the colours"""

    bl_options = {"REGISTER", "UNDO"}

    aspect: bpy.props.EnumProperty(
        name="Show",
        description="Meaning of the road's colours",
        items=ASPECTS,
        default="times",
    )

    obstacles = (why_no_coverage,)

    def act(self, context: bpy.types.Context) -> None:
        """Colour it."""
        colour_coverage(context.scene, self.aspect)
        context.scene.seip.view.legend = True
        view = context.space_data
        if isinstance(view, bpy.types.SpaceView3D) and not shows_coverage(view):
            set_shading(view)


class SEIP_OT_hide_overlay(ShortWork, bpy.types.Operator):
    """Hide these points or lines"""

    bl_label = "Hide"

    name: bpy.props.StringProperty(name="Name", description="Name of the overlay")

    def act(self, context: bpy.types.Context) -> None:
        """Hide it."""
        overlays.hide(context.scene, self.name)


def sight_overlay(sight: SightLines, label: str) -> Overlay:
    """Return the lines from a sensor to the targets that it sees, and squares on those that it does not."""
    ends = sight.ends + np.array((0.0, 0.0, ABOVE))
    lines = np.stack([np.broadcast_to(sight.eye, ends.shape), ends], axis=1).reshape(-1, 3)
    layers = (
        Layer("TRIS", _faces(sight.hidden), HIDDEN),
        Layer("TRIS", _faces(sight.missed), MISSED),
        Layer("LINES", lines.astype(np.float32), LINES),
    )
    drawn = "" if len(sight.ends) == sight.seen else f", {len(sight.ends):,} of them drawn"
    block = Block(
        f"{label}: {sight.in_range:,} targets in its range",
        (
            Entry(f"{sight.seen:,} seen{drawn}", (LINES,)),
            Entry(f"{len(sight.hidden):,} hidden by something", (HIDDEN,)),
            Entry(f"{len(sight.missed):,} in view, but between beams or too faint", (MISSED,)),
        ),
    )
    return Overlay(layers, lambda _scene: block)


def _faces(squares: Float) -> NDArray[np.float32]:
    """Return the two triangles of each square, (6 m, 3), above the road."""
    corners = (squares + np.array((0.0, 0.0, ABOVE))).astype(np.float32)
    faces: NDArray[np.float32] = corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    return faces


class SEIP_OT_show_sight_lines(ForPlacement, LongWork, bpy.types.Operator):
    """Draw lines from the sensor that is active in the list to the targets that it sees, and squares on those in its range that it does not see"""  # noqa: E501  # a tooltip is one line

    bl_options = {"REGISTER"}  # nothing in the file changes

    def job(self, scene: bpy.types.Scene) -> Job:
        """Restore the placement, and draw them."""
        scene, state = yield with_placement(scene)
        session.of(scene).state = state
        obj, label = active_sensor(scene), scene.seip.result.active_label()
        survey, _ = state.placed()
        key = str(obj.get(contract.SENSOR))
        pose = pose_at(survey.site.candidates, key, *pose_of(obj))
        if pose is None:
            raise SeipError(f"{label} is not at a candidate pose: move it back, or place again")
        settings = survey.settings
        row = survey.grid.sees(pose)
        sight = sight_lines(survey.site, pose, survey.models[key], row, settings.visibility.delta, settings.engine)
        overlays.show(scene, SIGHT_LINES, sight_overlay(sight, label))


def draw_view(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw what can be shown."""
    nothing = why_no_coverage(context.scene) and no_placement(context.scene)
    if not draw_reason(layout, "There is nothing to show yet." if nothing else ""):
        _draw_coverage(layout, context)
        _draw_sight(layout, context)


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
    if not draw_reason(column, why_no_coverage(context.scene)) and not shows_coverage(context.space_data):
        text = "This view's shading does not show the colours: press one of them."
        draw_sentence(column, text, icon="ERROR")


def _draw_sight(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the button that shows the sight lines of the active sensor."""
    column = layout.column(align=True)
    column.label(text="Sight Lines")
    label = context.scene.seip.result.active_label() or "Sensor"
    draw_run(column, "seip.show_sight_lines", icon="LIGHT_SPOT", text=f"From {label}")
    if overlays.find(context.scene, SIGHT_LINES) is not None:
        column.operator("seip.hide_overlay", icon="X").name = SIGHT_LINES
    draw_reason(column, no_placement(context.scene))
