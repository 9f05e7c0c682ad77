"""Entry points outside the sidebar: File ▸ Import, files dropped into a view, and menus, which the search uses."""

from __future__ import annotations

import bpy

from ..operators.site import EXTRACTS

STEPS: tuple[tuple[str, ...], ...] = (
    ("load_example", "download_map", "choose_map", "build_site", "check_site"),
    ("add_catalogue", "preview_beams", "solve_placement"),
    ("evaluate_sensors", "export_result"),
    ("colour_coverage", "save_picture"),
    ("load_traffic", "simulate_traffic", "scan_frame", "write_dataset", "detect"),
    ("stop",),
)
"""Operators of the menu, by step of the work."""


class SEIP_FH_map(bpy.types.FileHandler):
    """A map or an extract that is dropped into a 3D view; Blender matches only the last suffix of a name."""

    bl_label = "OpenDRIVE or OpenStreetMap"
    bl_import_operator = "seip.choose_map"
    bl_file_extensions = ".xodr;.osm;.gz"

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        """Return whether this is a 3D view."""
        return context.area is not None and context.area.type == "VIEW_3D"


class SEIP_MT_main(bpy.types.Menu):
    """Menu with the operators of the sidebar, by name."""

    bl_label = "SEIP"

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the steps in their order."""
        layout = self.layout
        layout.operator_context = "INVOKE_DEFAULT"
        for step in STEPS:
            for operator in step:
                layout.operator(f"seip.{operator}")
            layout.separator()


def draw_import(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw what File ▸ Import gets."""
    for text, pattern in (("OpenDRIVE (.xodr)", "*.xodr"), ("OpenStreetMap (.osm)", EXTRACTS)):
        menu.layout.operator("seip.choose_map", text=text).filter_glob = pattern


def draw_add(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw what the menu Add gets."""
    menu.layout.operator_context = "INVOKE_DEFAULT"
    menu.layout.operator("seip.load_example", text="SEIP Example")
    menu.layout.operator_menu_enum("seip.add_area", "role", text="SEIP Area")


def draw_object(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw what the menu Object gets."""
    menu.layout.menu(SEIP_MT_main.__name__)


MENUS = (("TOPBAR_MT_file_import", draw_import), ("VIEW3D_MT_add", draw_add), ("VIEW3D_MT_object", draw_object))
