"""Entry points outside the sidebar: File ▸ Import, files dropped into a view, and menus, which the search uses."""

from __future__ import annotations

import bpy

from ..operators.base import SEIP_OT_stop
from ..operators.detection import SEIP_OT_detect
from ..operators.placement import SEIP_OT_compute_visibility, SEIP_OT_solve_placement
from ..operators.results import SEIP_OT_evaluate_sensors, SEIP_OT_export_result
from ..operators.sensors import SEIP_OT_add_catalogue, SEIP_OT_preview_beams
from ..operators.simulation import SEIP_OT_simulate_traffic
from ..operators.site import (
    EXTRACTS,
    SEIP_OT_add_area,
    SEIP_OT_build_site,
    SEIP_OT_check_site,
    SEIP_OT_choose_map,
    SEIP_OT_download_map,
    SEIP_OT_load_example,
)
from ..operators.traffic import SEIP_OT_load_traffic, SEIP_OT_scan_frame, SEIP_OT_write_dataset
from ..operators.view import SEIP_OT_colour_coverage, SEIP_OT_save_picture

OPENDRIVE = "*.xodr"


class _Dropped:
    """A mixin: a file that is dropped into a 3D view is imported."""

    bl_import_operator = SEIP_OT_choose_map.bl_idname

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        """Return whether this is a 3D view."""
        return context.area is not None and context.area.type == "VIEW_3D"


class SEIP_FH_opendrive(_Dropped, bpy.types.FileHandler):
    """A map."""

    bl_idname = "SEIP_FH_opendrive"
    bl_label = "OpenDRIVE"
    bl_file_extensions = ".xodr"


class SEIP_FH_openstreetmap(_Dropped, bpy.types.FileHandler):
    """An extract; of a name with two suffixes Blender looks at the last alone."""

    bl_idname = "SEIP_FH_openstreetmap"
    bl_label = "OpenStreetMap"
    bl_file_extensions = ".osm;.gz"


class SEIP_MT_main(bpy.types.Menu):
    """Menu with the operators of the sidebar, by name."""

    bl_idname = "SEIP_MT_main"
    bl_label = "SEIP"

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the steps in their order."""
        layout = self.layout
        layout.operator_context = "INVOKE_DEFAULT"
        for step in STEPS:
            for operator in step:
                layout.operator(operator.bl_idname)
            layout.separator()


STEPS: tuple[tuple[type[bpy.types.Operator], ...], ...] = (
    (SEIP_OT_load_example, SEIP_OT_download_map, SEIP_OT_choose_map, SEIP_OT_build_site, SEIP_OT_check_site),
    (SEIP_OT_add_catalogue, SEIP_OT_preview_beams, SEIP_OT_compute_visibility, SEIP_OT_solve_placement),
    (SEIP_OT_evaluate_sensors, SEIP_OT_export_result),
    (SEIP_OT_colour_coverage, SEIP_OT_save_picture),
    (SEIP_OT_load_traffic, SEIP_OT_simulate_traffic, SEIP_OT_scan_frame, SEIP_OT_write_dataset, SEIP_OT_detect),
    (SEIP_OT_stop,),
)
"""Operators of the menu, by step of the work."""


def draw_import(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw what File ▸ Import gets."""
    for text, pattern in (("OpenDRIVE (.xodr)", OPENDRIVE), ("OpenStreetMap (.osm)", EXTRACTS)):
        menu.layout.operator(SEIP_OT_choose_map.bl_idname, text=text).filter_glob = pattern


def draw_add(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw what the menu Add gets."""
    menu.layout.operator_context = "INVOKE_DEFAULT"
    menu.layout.operator(SEIP_OT_load_example.bl_idname, text="SEIP Example")
    menu.layout.operator_menu_enum(SEIP_OT_add_area.bl_idname, "role", text="SEIP Area")


def draw_object(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw what the menu Object gets."""
    menu.layout.menu(SEIP_MT_main.bl_idname)


MENUS = (("TOPBAR_MT_file_import", draw_import), ("VIEW3D_MT_add", draw_add), ("VIEW3D_MT_object", draw_object))
CLASSES = (SEIP_FH_opendrive, SEIP_FH_openstreetmap, SEIP_MT_main)


def attach() -> None:
    """Add to Blender's menus."""
    for name, draw in MENUS:
        getattr(bpy.types, name).append(draw)


def detach() -> None:
    """Take that away."""
    for name, draw in MENUS:
        getattr(bpy.types, name).remove(draw)
