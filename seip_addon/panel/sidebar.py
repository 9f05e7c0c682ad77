"""The sidebar: three steps to a placement and what follows, its properties, and the entries in Blender's menus."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import BoolProperty, CollectionProperty, IntProperty, PointerProperty

from . import (
    coverage,
    detection,
    export,
    objective,
    placement,
    results,
    scans,
    scene_status,
    sensors,
    site,
    site_check,
    survey,
    traffic,
)
from .layout import Sidebar, Status, draw_sections

STEPS: tuple[tuple[str, ...], ...] = (
    ("load_example", "download_map", "choose_map", "build_site", "check_site"),
    ("add_catalogue", "preview_beams", "solve_placement"),
    ("evaluate_sensors", "export_result"),
    ("colour_coverage",),
    ("load_traffic", "simulate_traffic", "scan_frame", "detect"),
    ("stop",),
)
"""Operators of the menu, by step of the work."""


def _section(title: str) -> Any:  # noqa: ANN401 -- what Blender makes of a property
    return BoolProperty(name=title, description="Show or hide this section", default=False)


class SEIP_PG_sections(bpy.types.PropertyGroup):
    """Open and closed sections of the sidebar."""

    site: _section("Site")
    sensors: _section("Sensors")
    placement: _section("Placement")
    change_site: _section("Change Site")
    sources: _section("Surroundings and Terrain")
    roles: _section("Roles of Objects")
    contents: _section("Contents")
    about_sensor: _section("About the Sensor")
    beams: _section("Beam Preview")
    numbers: _section("Number of Sensors")
    details: _section("Details")
    objective: _section("Objective")
    rules: _section("Weights and Positions")
    candidates: _section("Positions, Weather, Price")
    search: _section("Search")
    results: _section("Results")
    view: _section("Coverage and Sight Lines")
    comparison: _section("Compare")
    traffic: _section("Traffic and Detection")
    simulation: _section("Traffic Simulation")
    scan: _section("Scan")
    detection: _section("Detection")
    export: _section("Export")

    def follow_steps(self, scene: bpy.types.Scene) -> None:
        """Open the current step of a scene and close the others."""
        current = scene_status.current_step(scene)
        self.site, self.sensors, self.placement = (step == current for step in ("site", "sensors", "placement"))


def forget() -> None:
    """Close all sections: another file is opened, whose current step is opened then."""
    if isinstance(bpy.data, bpy.types.BlendData):  # Blender shows nobody the open file while it registers an add-on
        bpy.context.window_manager.property_unset("seip_sections")


class SEIP_PG_scene(bpy.types.PropertyGroup):
    """All that SEIP keeps with a scene."""

    version: IntProperty(name="Version", default=scene_status.FILE_VERSION, options={"HIDDEN"})
    site: PointerProperty(type=site.SEIP_PG_site)
    survey: PointerProperty(type=survey.SEIP_PG_survey)
    goal: PointerProperty(type=objective.SEIP_PG_goal)
    result: PointerProperty(type=results.SEIP_PG_result)
    kept: CollectionProperty(type=results.SEIP_PG_placement)
    active_kept: IntProperty(name="Kept Placement", description="Placement to compare the present one with")
    view: PointerProperty(type=coverage.SEIP_PG_view)
    traffic: PointerProperty(type=traffic.SEIP_PG_traffic)
    simulation: PointerProperty(type=traffic.SEIP_PG_simulation)
    detection: PointerProperty(type=detection.SEIP_PG_detection)


class SEIP_PT_steps(Sidebar, bpy.types.Panel):
    """Panel: the three steps to a placement, each with its status, and what follows."""

    bl_label = "Sensor Placement"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the sections."""
        scene, layout = context.scene, self.layout
        steps = {"site": site.draw, "sensors": sensors.draw, "placement": placement.draw}
        parts = {"site": site_check, "sensors": sensors, "placement": placement}
        draw_sections(layout, steps, context, {name: part.status(scene) for name, part in parts.items()})
        layout.separator(type="LINE")
        states = {
            "results": Status(scene_status.is_changed(scene)),
            "traffic": Status(detection.status(scene).changed),
        }
        after = {"results": results.draw, "traffic": draw_traffic, "export": export.draw}
        draw_sections(layout, after, context, states)


def draw_traffic(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw traffic, and the sections of all that is done with it."""
    traffic.draw(layout, context)
    parts = {"simulation": traffic.draw_simulation, "scan": scans.draw_scan, "detection": detection.draw}
    draw_sections(layout, parts, context, {"detection": detection.status(context.scene)})


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
    for text, pattern in (("OpenDRIVE (.xodr)", "*.xodr"), ("OpenStreetMap (.osm)", site.EXTRACTS)):
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
PROPERTIES = (
    (bpy.types.Scene, "seip", PointerProperty(type=SEIP_PG_scene)),
    (bpy.types.WindowManager, "seip_sections", PointerProperty(type=SEIP_PG_sections)),
)
