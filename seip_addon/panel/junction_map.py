"""Map of the streets in a viewport, on which a junction is chosen by mouse."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import blf
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ..core.base.arrays import Float, Integer
from ..core.geometry.map_view import MapView, under_mouse
from ..core.output.pictures.palette import MAP_GROUND, MAP_JUNCTION, MAP_STREETS, rgb
from ..core.output.pictures.street_labels import StreetLabel, start_of, street_labels
from ..core.workflows.site_places import SitePlaces
from ..core.world.opendrive.junctions import STREETS
from .legend import FONT, INK, PAPER, TEXT_SIZE, Box, Colour, fill, free_frame, write
from .overlays import viewports
from .session import session
from .work import Outcome

HELP = (
    *("Click a junction", "Esc: cancel", "Enter: list in the sidebar"),
    *("Wheel: zoom", "Drag: pan", "Home: all"),
)
ESSENTIAL = 3
"""Number of parts of the help that are drawn where all need more than one line; the status bar has all of them."""
BETWEEN = "  ·  "
"""Between two parts of the help."""
STREET_WIDTHS, DOT_RADII = (1.2, 2.2, 3.6), (3.5, 5.0, 6.5)
"""Pixels at the interface's usual scale, by importance of the street or junction."""
HOVERED = 1.6
"""Size of the junction under the mouse, in sizes of the others."""
DOT_ROOM, DOT_SPACING = 50.0, 14.0
"""Pixels at the interface's usual scale: side of the square that each junction has on average, otherwise the less
important ones are left out; and side of a square in which one junction is drawn at most."""
CORNERS = 24
"""Corners of the polygon that stands for a dot."""
SLACK, LINE, PAD = 4.0, 22.0, 8.0
"""Pixels at the interface's usual scale: beside a dot, height of a line of text, and beside words."""
STEP = 1.25
"""Factor of one notch of the wheel."""
CLICK = 4.0
"""Pixels at the interface's usual scale that the mouse moves at most between press and release of a click."""
ZOOMS = {"WHEELUPMOUSE": STEP, "WHEELDOWNMOUSE": 1 / STEP, "NUMPAD_PLUS": STEP, "NUMPAD_MINUS": 1 / STEP}
DRAGGED_BY = {"LEFTMOUSE", "MIDDLEMOUSE"}
GROUND, JUNCTION = (*rgb(MAP_GROUND), 1.0), (*rgb(MAP_JUNCTION), 1.0)


class StreetMap:
    """Map, its view, and what the mouse does with it.

    Parameters
    ----------
    places : SitePlaces
        Junctions with their plan.
    frame : (left, bottom, right, top), pixels
        Free part of the viewport.
    scale : float
        Scale of the interface.
    """

    def __init__(self, places: SitePlaces, frame: Box, scale: float) -> None:
        self.plan = places.plan
        self.names = [one.name for one in places.places]
        self.scale = scale
        self.view = MapView.fitted(self.plan.junctions, self._within(frame))
        self.hovered: int | None = None
        self.labels: list[StreetLabel] = []
        self._drag: tuple[str, tuple[float, float]] | None = None
        self._dragged = False
        self._mouse = (0.0, 0.0)
        self._labelled: MapView | None = None
        self._widths: Float | None = None
        self._batches: list[tuple[Any, int]] | None = None

    def handle(self, event: bpy.types.Event, mouse: tuple[float, float]) -> str:
        """Take an event at a pixel, and return ``PICK``, ``LIST``, ``CANCEL`` or "".

        The junction that was picked is `hovered`.
        """
        if event.type == "ESC" and event.value == "PRESS":
            return "CANCEL"
        if event.type in {"RET", "NUMPAD_ENTER"} and event.value == "PRESS":
            return "LIST"
        if event.type == "HOME" and event.value == "PRESS":
            self.view = MapView.fitted(self.plan.junctions, self.view.frame)
        elif event.type in ZOOMS and event.value == "PRESS":
            self.view = self.view.zoomed(ZOOMS[event.type], mouse)
        elif event.type in DRAGGED_BY and event.value == "PRESS":
            self._drag, self._dragged = (event.type, mouse), False
        elif self._drag is not None and event.type == self._drag[0] and event.value == "RELEASE":
            was_click = self._drag[0] == "LEFTMOUSE" and not self._dragged
            self._drag = None
            self._hover(mouse)
            return "PICK" if was_click and self.hovered is not None else ""
        elif event.type == "MOUSEMOVE" and self._drag is not None:
            self._follow(mouse)
        self._mouse = mouse
        if self._drag is None:
            self._hover(mouse)
        return ""

    def is_dragged(self) -> bool:
        """Return whether a button of the mouse is held that was pressed over the map."""
        return self._drag is not None

    def _follow(self, mouse: tuple[float, float]) -> None:
        """Move the map with the mouse, once it has moved too far for a click."""
        if self._drag is None:
            return
        start = self._drag[1]
        if not self._dragged and np.hypot(mouse[0] - start[0], mouse[1] - start[1]) > CLICK * self.scale:
            self._dragged = True
            self._mouse = start
        if self._dragged:
            self.view = self.view.panned(mouse[0] - self._mouse[0], mouse[1] - self._mouse[1])

    def _hover(self, mouse: tuple[float, float]) -> None:
        shown = self.shown()
        found = under_mouse(
            self.view.to_pixels(self.plan.junctions[shown]), self.radii()[shown], mouse, SLACK * self.scale
        )
        self.hovered = None if found is None else int(shown[found])

    def radii(self) -> Float:
        """Return the radius of each junction's dot, pixels."""
        return np.array(DOT_RADII)[self.plan.importance] * self.scale

    def shown(self) -> Integer:
        """Return the junctions that are drawn: in view, and the more important ones where there are too many."""
        pixels = self.view.to_pixels(self.plan.junctions)
        left, bottom, right, top = self.view.frame
        inside = np.all((pixels >= (left, bottom)) & (pixels <= (right, top)), axis=1)
        most = (right - left) * (top - bottom) / (DOT_ROOM * self.scale) ** 2
        for least in range(len(DOT_RADII)):
            shown = np.flatnonzero(inside & (self.plan.importance >= least))
            if len(shown) <= most:
                break
        shown = shown[np.argsort(-self.plan.importance[shown], kind="stable")]
        # Squares of the plan, not of the view: the choice does not change as the map is panned.
        cells = np.floor(self.plan.junctions[shown] * self.view.scale / (DOT_SPACING * self.scale))
        return np.sort(shown[np.unique(cells, axis=0, return_index=True)[1]])

    def draw(self, frame: Box, chosen: str) -> None:
        """Draw the map over the free part of a viewport, in pixels.

        A sidebar shows through what is below it, and its letters would be lost on the ground of the map.

        Parameters
        ----------
        frame : (left, bottom, right, top), pixels
            Free part of the viewport.
        chosen : str
            Name of the junction that is chosen already.
        """
        self.view = self.view.moved_to(self._within(frame))
        left, bottom, right, top = map(round, frame)
        before = gpu.state.scissor_get()
        gpu.state.scissor_test_set(True)  # noqa: FBT003  # Blender's own function
        gpu.state.scissor_set(left, bottom, right - left, top - bottom)
        fill(left, bottom, right - left, top - bottom, (GROUND, GROUND))
        self._draw_streets()
        self._draw_names()
        self._draw_junctions(chosen)
        self._draw_frame_texts(frame)
        gpu.state.scissor_set(*before)
        gpu.state.scissor_test_set(False)  # noqa: FBT003  # as above

    def _draw_streets(self) -> None:
        if self._batches is None:
            self._batches = self._street_batches()
        shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
        gpu.state.blend_set("ALPHA")
        with gpu.matrix.push_pop():
            gpu.matrix.translate(self.view.origin)
            gpu.matrix.scale_uniform(self.view.scale)
            shader.bind()
            _, _, width, height = gpu.state.viewport_get()
            shader.uniform_float("viewportSize", (width, height))
            for batch, importance in self._batches:
                shader.uniform_float("lineWidth", STREET_WIDTHS[importance] * self.scale)
                shader.uniform_float("color", (*rgb(MAP_STREETS[importance]), 1.0))
                batch.draw(shader)
        gpu.state.blend_set("NONE")

    def _street_batches(self) -> list[tuple[Any, int]]:
        """Return one batch for all streets of an importance: panning and zooming only change a matrix."""
        shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
        batches = []
        for importance in range(len(STREET_WIDTHS)):
            lines = [one.line for one in self.plan.streets if one.importance == importance]
            if lines:
                ends = np.concatenate([np.stack((line[:-1], line[1:]), axis=1).reshape(-1, 2) for line in lines])
                flat = np.column_stack((ends, np.zeros(len(ends)))).astype(np.float32)
                batches.append((batch_for_shader(shader, "LINES", {"pos": flat}), importance))
        return batches

    def _draw_names(self) -> None:
        blf.size(FONT, TEXT_SIZE * self.scale)
        if self._widths is None:
            self._widths = np.array([width_of(name) for name in self.plan.names.names], dtype=np.float64)
        if self._labelled != self.view:
            shown = self.shown()
            dots = np.column_stack((self.view.to_pixels(self.plan.junctions), self.radii()))[shown]
            self.labels = street_labels(self.plan.names, self._widths, TEXT_SIZE * self.scale, self.view, dots)
            self._labelled = self.view
        blf.enable(FONT, blf.ROTATION | blf.SHADOW)
        blf.shadow(FONT, 6, *GROUND)
        blf.color(FONT, *INK)
        for label in self.labels:
            width = width_of(label.name)
            blf.rotation(FONT, label.angle)
            blf.position(FONT, *start_of(label, width, 0.7 * TEXT_SIZE * self.scale), 0)
            blf.draw(FONT, label.name)
        blf.disable(FONT, blf.ROTATION | blf.SHADOW)

    def _draw_junctions(self, chosen: str) -> None:
        shown = self.shown()
        pixels, radii = self.view.to_pixels(self.plan.junctions), self.radii()
        for size in np.unique(radii[shown]):
            of_size = pixels[shown[radii[shown] == size]]
            _dots(of_size, size + 1.5 * self.scale, GROUND)
            _dots(of_size, size, JUNCTION)
        marked = [number for number in shown.tolist() if self.names[number] == chosen or number == self.hovered]
        for number in marked:
            radius = HOVERED * radii[number]
            _dots(pixels[[number]], radius + 2 * self.scale, JUNCTION)
            _dots(pixels[[number]], radius, GROUND)
            _dots(pixels[[number]], radius / 2, JUNCTION)
            self._draw_name_of(number, pixels[number].tolist(), radius + 6 * self.scale)

    def _draw_name_of(self, number: int, at: Sequence[float], above: float) -> None:
        """Write the name of a junction above it, inside the frame."""
        x, y = at
        left, bottom, right, top = self.view.frame
        pad, line = PAD * self.scale, LINE * self.scale
        lines = _wrapped(self.names[number].split(STREETS), STREETS, right - left - 2 * pad)
        wide, tall = max(width_of(words) for words in lines) + 2 * pad, line * len(lines)
        low = y + above if y + above + tall < top else y - above - tall
        start = max(left, min(x - wide / 2, right - wide))
        low = max(low, bottom)
        fill(start, low, wide, tall, (INK, INK))
        blf.color(FONT, *PAPER[:3], 1.0)
        for row, words in enumerate(reversed(lines)):
            blf.position(FONT, start + pad, low + (row + 0.32) * line, 0)
            blf.draw(FONT, words)

    def _help(self, frame: Box) -> list[str]:
        """Return the lines of help at the top of a frame."""
        blf.size(FONT, TEXT_SIZE * self.scale)
        room = frame[2] - frame[0] - 2 * PAD * self.scale
        lines = _wrapped(HELP, BETWEEN, room)
        return lines if len(lines) == 1 else _wrapped(HELP[:ESSENTIAL], BETWEEN, room)

    def _credit(self, frame: Box) -> list[str]:
        """Return the lines of the data's credit at the bottom of a frame."""
        blf.size(FONT, TEXT_SIZE * self.scale)
        words = self.plan.attribution.split()
        return [] if not words else _wrapped(words, " ", frame[2] - frame[0] - 2 * PAD * self.scale)

    def _within(self, frame: Box) -> Box:
        """Return the part of a frame between help and credit."""
        left, bottom, right, top = frame
        low, high = (LINE * self.scale * len(lines) for lines in (self._credit(frame), self._help(frame)))
        return left, bottom + low, right, max(bottom + low, top - high)

    def _draw_frame_texts(self, frame: Box) -> None:
        """Write the help at the top, and the credit of the data in the lower right corner."""
        left, bottom, right, top = frame
        line, pad = LINE * self.scale, PAD * self.scale
        lines = self._help(frame)
        fill(left, top - line * len(lines), right - left, line * len(lines), (PAPER, PAPER))
        for number, words in enumerate(lines, start=1):
            write(words, left + pad, top - line * (number - 0.1), self.scale)
        lines = self._credit(frame)
        if not lines:
            return
        wide = max(width_of(words) for words in lines) + 2 * pad
        fill(right - wide, bottom, wide, line * len(lines), (PAPER, PAPER))
        for number, words in enumerate(reversed(lines)):
            write(words, right - wide + pad, bottom + line * (number + 0.1), self.scale)


def width_of(words: str) -> float:
    """Return the width of words in the size that was set last, pixels."""
    return float(blf.dimensions(FONT, words)[0])


def _wrapped(parts: Sequence[str], between: str, room: float) -> list[str]:
    """Return parts of a text in lines no wider than a number of pixels, except for parts that are wider."""
    lines = [parts[0]]
    for part in parts[1:]:
        longer = lines[-1] + between + part
        if width_of(longer) <= room:
            lines[-1] = longer
        else:
            lines.append(part)
    return lines


def _dots(middles: Float, radius: float, colour: Colour) -> None:
    """Draw discs whose edge fades over a pixel; points of a size are squares on some graphics cards."""
    angles = np.linspace(0.0, 2.0 * np.pi, CORNERS + 1)
    rim = np.stack((np.cos(angles), np.sin(angles)), axis=1)
    inner, outer = rim * (radius - 0.5), rim * (radius + 0.5)
    faces = [np.stack((np.zeros((CORNERS, 2)), inner[:-1], inner[1:]), axis=1)]
    faces += [
        np.stack(three, axis=1) for three in ((inner[:-1], outer[:-1], outer[1:]), (inner[:-1], outer[1:], inner[1:]))
    ]
    disc, fading = np.concatenate(faces).reshape(-1, 2), np.repeat([0, 1, 2], CORNERS)
    opacity = np.ones((len(fading), 3))
    opacity[fading == 1, 1:] = 0.0
    opacity[fading == 2, 1] = 0.0
    colours = np.column_stack((np.tile(colour[:3], (3 * len(fading), 1)), colour[3] * opacity.reshape(-1)))
    places = (middles[:, None] + disc).reshape(-1, 2)
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    content = {
        "pos": np.column_stack((places, np.zeros(len(places)))).astype(np.float32),
        "color": np.tile(colours, (len(middles), 1)).astype(np.float32),
    }
    gpu.state.blend_set("ALPHA")
    batch_for_shader(shader, "TRIS", content).draw(shader)
    gpu.state.blend_set("NONE")


class SEIP_OT_pick_junction(bpy.types.Operator):
    """Choose the junction of the site on a map of the streets"""

    bl_idname = "seip.pick_junction"
    bl_label = "Pick Junction"
    bl_options = {"INTERNAL", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return whether there is a map to draw, and a viewport to draw it in."""
        return session.places is not None and bool(session.places.places) and viewport_of(context.window) is not None

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> Outcome:
        """Draw the map in the largest viewport of the window, and wait for the mouse."""
        area = viewport_of(context.window)
        if area is None or session.places is None:
            return {"CANCELLED"}
        self._places, self._scene = session.places, context.scene.session_uid
        self._window, self._area = context.window, area
        self._region = next(region for region in area.regions if region.type == "WINDOW")
        space = area.spaces.active
        self._shown = space.show_gizmo, space.show_region_hud, space.overlay.show_text
        space.show_gizmo = space.show_region_hud = space.overlay.show_text = False  # they would be over the map
        self._map = StreetMap(self._places, free_frame(area, self._region), context.preferences.system.ui_scale)
        self._handle: Any = bpy.types.SpaceView3D.draw_handler_add(self._draw, (), "WINDOW", "POST_PIXEL")
        context.window_manager.modal_handler_add(self)
        if context.workspace is not None:
            context.workspace.status_text_set(BETWEEN.join(HELP))
        area.tag_redraw()
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> Outcome:
        """Take what happens over the map, and leave all else to Blender."""
        if not self._is_current(context):
            self._end(context)
            return {"CANCELLED"}
        mouse = (event.mouse_x - self._region.x, event.mouse_y - self._region.y)
        is_over = self._is_over(event.mouse_x, event.mouse_y) or self._map.is_dragged()
        if event.type.startswith("TIMER") or (not is_over and event.type != "ESC"):
            return {"PASS_THROUGH"}
        before = self._map.view, self._map.hovered
        action = self._map.handle(event, mouse)
        if before != (self._map.view, self._map.hovered):
            self._area.tag_redraw()
        if not action:
            return {"RUNNING_MODAL"}
        self._end(context)
        if action == "CANCEL":
            return {"CANCELLED"}
        if action == "PICK" and self._map.hovered is not None:
            context.scene.seip.site.junction = self._map.names[self._map.hovered]
        return {"FINISHED"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Remove the map: Blender quits or opens another file."""
        self._end(context)

    def _is_current(self, context: bpy.types.Context) -> bool:
        """Return whether the map is still of the file that is chosen, and its viewport still there."""
        return (
            session.places is self._places
            and context.scene.session_uid == self._scene
            and viewport_of(self._window) == self._area
        )

    def _is_over(self, x: int, y: int) -> bool:
        """Return whether a place in the window is on the map, and not on a header, toolbar or sidebar over it."""
        there = [
            one for one in self._area.regions if one.x <= x < one.x + one.width and one.y <= y < one.y + one.height
        ]
        return [one.type for one in there] == [self._region.type]

    def _draw(self) -> None:
        if bpy.context.area == self._area:
            self._map.draw(free_frame(self._area, self._region), bpy.context.scene.seip.site.junction)

    def _end(self, context: bpy.types.Context) -> None:
        bpy.types.SpaceView3D.draw_handler_remove(self._handle, "WINDOW")
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        if viewport_of(self._window) == self._area:
            space = self._area.spaces.active
            space.show_gizmo, space.show_region_hud, space.overlay.show_text = self._shown
            self._area.tag_redraw()


def viewport_of(window: bpy.types.Window | None) -> bpy.types.Area | None:
    """Return the largest 3D viewport of a window, or None."""
    areas = [] if window is None else viewports([window])
    return max(areas, key=lambda area: area.width * area.height, default=None)
