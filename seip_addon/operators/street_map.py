"""Operator that lets a user pick a junction on a map of the streets."""

from __future__ import annotations

from typing import Any

import bpy

from ..state.session import session
from ..viewport.free_frame import free_frame
from ..viewport.overlays import viewports
from ..viewport.street_map import BETWEEN, HELP, StreetMap
from .base import Outcome


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
        bpy.ops.seip.choose_place("INVOKE_DEFAULT")
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
