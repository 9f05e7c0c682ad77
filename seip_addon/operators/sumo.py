"""The operator that installs SUMO into the extension's own folder."""

from __future__ import annotations

from collections.abc import Generator

import bpy

from .. import preferences
from ..core.errors import SeipError
from ..core.progress import Progress
from ..core.sumo_installation import install_sumo
from ..core.sumo_programs import Sumo
from .base import Conditional, LongWork, Outcome


class SEIP_OT_install_sumo(Conditional, LongWork[Sumo], bpy.types.Operator):
    """Download Eclipse SUMO from PyPI into the extension's own folder, where it takes up to 470 MB. It lays out the streets of an extract of OpenStreetMap and simulates traffic"""  # noqa: E501  # a tooltip is one line

    bl_idname = "seip.install_sumo"
    bl_label = "Install SUMO"
    bl_options = {"REGISTER"}  # nothing in the file changes
    stopped_message = "stopped; SUMO was not installed"

    @classmethod
    def why_not(cls, _context: bpy.types.Context) -> str:
        """Return a reason if Blender may not go online or has no pip."""
        return preferences.why_no_installation()

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event | None) -> Outcome:
        """Start in the main window: work ends with its window, and that of the preferences is soon closed."""
        main = next((window for window in context.window_manager.windows if window.parent is None), context.window)
        with context.temp_override(window=main):
            return super().invoke(context, event)

    def prepare(self, _scene: bpy.types.Scene) -> Generator[Progress, None, Sumo]:
        """Take pip and the folder."""
        reason = preferences.why_no_installation()
        if reason:
            raise SeipError(reason)
        return install_sumo(preferences.pip(), preferences.own_sumo_folder())

    def conclude(self, _scene: bpy.types.Scene, _result: Sumo) -> None:
        """Report what is there now."""
        self.report({"INFO"}, preferences.sumo_status()[0])


CLASSES = (SEIP_OT_install_sumo,)
