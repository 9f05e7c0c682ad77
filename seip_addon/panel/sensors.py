"""The step "Sensors": the table of products, those to choose from, catalogues, heights and tilts, and their beams."""

from __future__ import annotations

import math
from functools import lru_cache

import bpy
import numpy as np

from ..core.base.errors import SeipError
from ..core.output.pictures.palette import DENSE_BEAMS, PAPER, WIDE_BEAMS, rgb
from ..core.output.results.placement_record import parsed_record
from ..core.sensing.lidar.catalogue import load_catalogue
from ..core.sensing.lidar.model import LidarModel
from ..core.sensing.lidar.rings import beam_rings
from ..core.sensing.returns.bodies import PANELS
from ..core.sensing.visibility.ring_resolution import unresolved_from
from ..core.sensing.visibility.road_range import road_range, upright_range
from ..core.sensing.visibility.settings import VisibilitySettings
from ..core.site.candidates import DEFAULT_TYPE
from ..scene import contract
from ..scene.materials import REFLECTIVITY
from . import overlays, preferences
from .layout import Status, draw_sections, draw_sentence, is_narrow, settings_column
from .legend import Block, Entry
from .overlays import Layer, Overlay
from .properties import absolute
from .scene_status import no_placement
from .session import session
from .work import Outcome, ShortWork

GENERIC = "generic"
"""Manufacturer of the types of the SEIP paper, which are models, not products."""
TABLE_WIDTH, TABLE_MARGIN = 760, 40
"""Width of the table, and of the window beside it, pixels at the usual scale of the interface."""
COLUMNS = (("Sensor", 0.40), ("Channels", 0.11), ("Field of view", 0.14), ("Pedestrian", 0.12), ("Price", 0.11))
"""Titles and shares of the width, with the range on a pedestrian; the rest shows what the detection law rests on."""
BEAMS = "beams"
DENSE, WIDE, CONE = (*rgb(DENSE_BEAMS), 0.9), (*rgb(WIDE_BEAMS), 0.9), (*rgb(PAPER), 0.35)
"""Colours of rings within 2δ of the next, of others, and of the edges of the field of view."""
WIDTH = 1.5  # pixels at the interface's usual scale
UPRIGHT = 1e-5  # radians
LIFT = 0.05  # metres of the rings above the road
Preview = tuple[LidarModel, tuple[float, ...], float, float]
"""Sensor whose beams are shown: model, the 16 entries of the matrix from its axes to the scene's, height above the road
in metres, and δ in metres."""
Beams = tuple[tuple[Layer, ...], Block]
"""Lines of the beams, and what their colours mean."""


def title(model: LidarModel) -> str:
    """Return manufacturer and product; of the paper's types, the name alone."""
    return model.name if model.manufacturer == GENERIC else f"{model.manufacturer} {model.name}"


def in_order() -> list[str]:
    """Return the keys of all types by manufacturer and product, the paper's last."""
    types = session.sensor_types
    return sorted(types, key=lambda key: (types[key].manufacturer == GENERIC, title(types[key]).casefold()))


def refresh() -> None:
    """Read the catalogues again and list new types in all scenes; if a file is invalid the shipped types stay."""
    session.sensor_types.clear()
    session.catalogue_error = ""
    try:
        session.sensor_types.update(preferences.catalogue())
    except SeipError as error:
        session.sensor_types.update(load_catalogue())
        session.catalogue_error = str(error)
    for scene in bpy.data.scenes:
        if scene.library is None:
            list_types(scene)


def list_types(scene: bpy.types.Scene) -> None:
    """Add to a scene's list the types that it lacks, and drop those that are neither known nor used.

    In a list that was empty, the default type is used.
    """
    types = scene.seip.survey.types
    is_new = not len(types)
    for number in reversed(range(len(types))):
        if types[number].name not in session.sensor_types and not types[number].use:
            types.remove(number)
    for key in session.sensor_types:
        if key not in types:
            one = types.add()
            one.name = key
            one.use = is_new and key == DEFAULT_TYPE


def _no_preferences(_scene: bpy.types.Scene) -> str:
    return "Install the add-on as an extension: only then it has preferences" if preferences.own() is None else ""


class SEIP_OT_add_catalogue(ShortWork, bpy.types.Operator):
    """Add a catalogue of your own, which docs/sensors.md describes"""

    obstacles = (_no_preferences,)

    filepath: bpy.props.StringProperty(
        name="File", description="Catalogue file", subtype="FILE_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"}
    )
    filter_glob: bpy.props.StringProperty(default="*.toml;*.json;*.xml;*.yaml;*.yml;*.csv", options={"HIDDEN"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> Outcome:
        """Open the file browser."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def act(self, context: bpy.types.Context) -> None:
        """Read it, and keep its name."""
        path = absolute(self.filepath)
        shipped = load_catalogue()
        models = load_catalogue([path])
        if path in preferences.catalogue_files():
            raise SeipError(f"{path.name} is a catalogue already: nothing was added")
        preferences.own().catalogues.add().path = str(path)
        context.preferences.is_dirty = True
        refresh()
        changed = sum(1 for key, model in models.items() if key not in shipped or model.source != shipped[key].source)
        self.report({"INFO"}, f"{path.name}: {changed} sensor types added or replaced")


class SEIP_OT_remove_catalogue(ShortWork, bpy.types.Operator):
    """Remove a catalogue of your own from the list; the file stays"""

    obstacles = (_no_preferences,)

    index: bpy.props.IntProperty(name="Number", description="Index of the catalogue, from 0", min=0)

    def act(self, context: bpy.types.Context) -> None:
        """Forget it."""
        files = preferences.own().catalogues
        if self.index >= len(files):
            raise SeipError(f"there is no catalogue {self.index}: there are {len(files)}, counted from 0")
        files.remove(self.index)
        context.preferences.is_dirty = True
        refresh()


class SEIP_OT_choose_sensors(bpy.types.Operator):
    """Choose the sensors that a placement may use, from a table of all products"""

    bl_idname = "seip.choose_sensors"
    bl_label = "Choose Sensors…"
    bl_options = {"REGISTER", "UNDO"}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> Outcome:
        """Show the table."""
        refresh()
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
        wanted, models = survey.filter.casefold(), session.sensor_types
        shown = [key for key in in_order() if wanted in f"{key} {title(models[key])}".casefold()]
        _row(layout, None, (*(name for name, _ in COLUMNS), "Detection law"))
        column = layout.column(align=True)
        column.scale_y = 0.85
        for key in shown:
            _row(column, survey.types.get(key), _cells(models[key]))
        if not shown:
            column.label(text="No product has this in its name.", icon="INFO")
        layout.operator("seip.add_catalogue", icon="ADD")


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


def _cells(model: LidarModel) -> tuple[str, ...]:
    low, high = math.degrees(model.elevations.min()), math.degrees(model.elevations.max())
    law = "calibrated" if model.calibration else "data sheet"
    return (
        title(model),
        f"{model.channels}",
        f"{math.degrees(model.field_of_view):.0f}° × {high - low:.0f}°",
        f"{upright_range(model, PANELS['pedestrian'].reflected, VisibilitySettings()):.0f} m",
        f"${model.price:,.0f}",
        "paper's model" if model.manufacturer == GENERIC else law,
    )


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


def _preview() -> Preview | None:
    """Return whose beams to show: the active sensor's, else the active type's at the 3D cursor; None if unknown."""
    scene, active = bpy.context.scene, bpy.context.object
    survey = scene.seip.survey
    height = float(survey.preview_height)
    if active is not None and active.get(contract.SENSOR) in session.sensor_types:
        model = session.sensor_types[active[contract.SENSOR]]
        matrix, height = np.array(active.matrix_world), float(active.get("seip_height", height))
    elif survey.shown_type() in session.sensor_types:
        model, matrix = session.sensor_types[survey.shown_type()], np.eye(4)
        matrix[:3, 3] = np.add(scene.cursor.location, (0.0, 0.0, height))
    else:
        return None
    return model, tuple(matrix.ravel().tolist()), height, float(survey.delta)


@lru_cache(maxsize=1)  # until the sensor, its pose or δ changes
def _beams(
    model: LidarModel, matrix: tuple[float, ...], height: float, delta: float
) -> tuple[tuple[Layer, ...], Block]:
    """Return the beams of a sensor.

    Up to the radius in the legend all rings before the sensor are within 2δ of each other.
    """
    placed = np.array(matrix).reshape(4, 4)
    axes = placed[:3, :3] / np.maximum(np.linalg.norm(placed[:3, :3], axis=0), 1e-9)
    tilt = math.asin(max(-1.0, min(1.0, -float(axes[2, 0]))))
    tilt = tilt if abs(tilt) > UPRIGHT else 0.0  # single precision cannot tell it from 0
    across = math.sqrt(max(model.max_range**2 - height**2, 0.0))
    resolved = unresolved_from(model, height, delta, across, tilt)
    lines = beam_rings(model, placed[:3, 3], axes, float(placed[2, 3]) - height + LIFT, 2 * delta)
    pieces = ((lines.cone, CONE), (lines.rings[lines.wide], WIDE), (lines.rings[~lines.wide], DENSE))
    where = f"{'in front ' if tilt else ''}up to {resolved:.0f} m"
    return tuple(
        Layer("LINES", piece.reshape(-1, 3).astype(np.float32), colour, WIDTH) for piece, colour in pieces if len(piece)
    ), Block(
        f"{model.name} at {height:.3g} m: no gaps on a level road {where}",
        (
            Entry(f"at most {2 * delta:.3g} m to the next ring inwards", (DENSE,)),
            Entry("more: road between may go unseen", (WIDE,)),
            Entry("edge of the field of view", (CONE,)),
        ),
    )


def beam_overlay() -> Overlay:
    """Return the beams of the sensor that is active when the view is drawn."""

    def legend(_scene: bpy.types.Scene) -> Block | None:
        preview = _preview()
        return None if preview is None else _beams(*preview)[1]

    def layers() -> tuple[Layer, ...]:
        preview = _preview()
        return () if preview is None else _beams(*preview)[0]

    return Overlay((), legend, moving=layers)


class SEIP_OT_preview_beams(ShortWork, bpy.types.Operator):
    """Show or hide the beams of the selected sensor, or else of the sensor shown in the sidebar at the 3D cursor: rings on a flat road and the edges of the vertical field of view"""  # noqa: E501  # a tooltip is one line

    def act(self, context: bpy.types.Context) -> None:
        """Show or hide them."""
        if overlays.find(context.scene, BEAMS):
            overlays.hide(context.scene, BEAMS)
        else:
            overlays.show(context.scene, BEAMS, beam_overlay())


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
        name = model.name if is_narrow(bpy.context) else title(model)
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
    """Draw how far a chosen product measures the road, and what its figures rest on."""
    survey = context.scene.seip.survey
    layout.prop_search(survey, "about", survey, "types", text="", icon="VIEWZOOM")
    model = session.sensor_types.get(survey.shown_type())
    if model is None:
        draw_sentence(layout, "Choose a sensor that is in the catalogue.", icon="INFO")
        return
    layout.label(text=title(model), translate=False)
    if heights := survey.parsed_heights():
        height = max(heights)
        far = road_range(model, REFLECTIVITY["asphalt"], height, VisibilitySettings())
        draw_sentence(layout, f"On dry asphalt, {height:g} m up: to {far:.0f} m")
    draw_sentence(layout, f"Detection: {model.evidence}")
    draw_sentence(layout, f"Figures: {model.source}")
    if model.assumed:
        draw_sentence(layout, f"Assumed: {model.assumed}")
    draw_sentence(layout, f"Price: {model.price_source or 'no source'}")


def _draw_beams(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the button; the legend in the view says what the colours of the rings mean."""
    shown = overlays.find(context.scene, BEAMS) is not None
    settings_column(layout).prop(context.scene.seip.survey, "preview_height")
    text = "Hide Beams" if shown else "Show Beams"
    layout.operator("seip.preview_beams", text=text, icon="LIGHT_SPOT", depress=shown)
