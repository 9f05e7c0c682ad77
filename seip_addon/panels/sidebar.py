"""Mixin that places a panel in the sidebar."""

from __future__ import annotations


class Sidebar:
    """A mixin: a panel in the tab SEIP of the 3D viewport's sidebar."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "SEIP"
