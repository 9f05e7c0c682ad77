"""Status of SUMO, and the button that installs it, for sidebar, dialog and preferences."""

from __future__ import annotations

import bpy

from .. import preferences
from ..core.programs.sumo_installation import sumo_size
from ..operators.traffic import SEIP_OT_install_sumo
from .sidebar import draw_run
from .wrapped_text import draw_sentence


def draw_missing(layout: bpy.types.UILayout) -> None:
    """Draw that SUMO is missing, and the ways to get it; nothing where it is there."""
    if preferences.sumo() is None:
        draw_status(layout)
        draw_preferences(layout)


def draw_preferences(layout: bpy.types.UILayout) -> None:
    """Draw the button that shows the add-on's preferences, if it has any."""
    if preferences.own() is not None:
        layout.operator("preferences.addon_show", text="Preferences").module = preferences.ADDON_ID


def draw_status(layout: bpy.types.UILayout) -> None:
    """Draw the SUMO in use, or the button that installs it."""
    status, works = preferences.sumo_status()
    draw_sentence(layout, f"{status}.", icon="CHECKMARK" if works else "ERROR")
    if not works:
        draw_installation(layout)


def draw_installation(layout: bpy.types.UILayout, *, in_one_row: bool = False) -> None:
    """Draw the button that installs SUMO, and why it cannot where there is more than one row."""
    reason = "" if in_one_row else preferences.why_no_installation()
    if reason:
        draw_sentence(layout, f"{reason}.", icon="INFO")
    text = f"{SEIP_OT_install_sumo.bl_label} ({sumo_size().download} MB)"
    draw_run(layout, "seip.install_sumo", icon="IMPORT", text=text, in_one_row=in_one_row)
