"""The panel of the site: where it comes from, what its objects mean, and whether it is sound."""

from __future__ import annotations

import bpy

from .. import scene_status
from ..core.site.roles import Role
from ..operators.site import (
    SEIP_OT_add_area,
    SEIP_OT_assign_role,
    SEIP_OT_build_site,
    SEIP_OT_check_site,
    SEIP_OT_choose_map,
    SEIP_OT_load_example,
    SEIP_OT_show_problem,
    SEIP_OT_take_out_of_role,
    has_site,
    missing_for_build,
    why_no_role,
)
from ..properties.site import SEIP_PG_site
from ..scene import roles
from .run_button import draw_run
from .sidebar import RowList, Sidebar, is_narrow, settings_column
from .wrapped_text import draw_sentence


class SEIP_PT_site(Sidebar, bpy.types.Panel):
    """The place that sensors are to watch."""

    bl_idname = "SEIP_PT_site"
    bl_label = "Site"

    def draw(self, context: bpy.types.Context) -> None:
        """Say what there is to begin with."""
        if not has_site(context.scene):
            draw_sentence(self.layout, "Begin with a map, or with roles of your own objects.", icon="INFO")


class SEIP_PT_site_map(Sidebar, bpy.types.Panel):
    """A site from a map."""

    bl_idname = "SEIP_PT_site_map"
    bl_parent_id = "SEIP_PT_site"
    bl_label = "From a Map"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the choice of the map and the place."""
        site = context.scene.seip.site
        layout = self.layout
        name = bpy.path.basename(site.source)
        if not name:
            draw_run(layout, SEIP_OT_load_example.bl_idname)
        draw_run(layout, SEIP_OT_choose_map.bl_idname, icon="FILE_FOLDER", text=name or "Choose Map…")
        if not name:
            return
        draw_place(layout, site)
        missing = missing_for_build(context.scene)
        if missing:
            draw_sentence(layout, f"{missing}.", icon="INFO")
        elif has_site(context.scene):
            draw_sentence(layout, "This scene has a site: a new scene is made.", icon="INFO")
        draw_run(layout, SEIP_OT_build_site.bl_idname)


def draw_place(layout: bpy.types.UILayout, site: SEIP_PG_site) -> None:
    """Draw the choice of a place in the chosen file, and how large the site is."""
    column = settings_column(layout)
    column.prop_search(site, "junction", site, "junctions", icon="DECORATE_DRIVER")
    if site.is_extract() and not site.junction:
        row = column.row()
        row.alert = bool(site.position and site.wrong_position())
        row.prop(site, "position")
    if site.is_described():
        draw_sentence(layout, "The place is the one that the description names.")
        return
    if site.junction or site.is_extract():
        column.prop(site, "region_shape")
    column.prop(site, "radius", text="Along Them" if site.follows_approaches() else "Radius")
    if not site.junction and not site.is_extract():
        draw_sentence(layout, "No junction: the middle of the map.")


class SEIP_PT_site_roles(Sidebar, bpy.types.Panel):
    """Panel: roles of objects."""

    bl_idname = "SEIP_PT_site_roles"
    bl_parent_id = "SEIP_PT_site"
    bl_label = "Roles of Objects"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw what the active object is, and the buttons that change that."""
        site = context.scene.seip.site
        layout = self.layout
        layout.prop(site, "role", text="")
        row = layout.row(align=True)
        row.operator(SEIP_OT_assign_role.bl_idname, icon="ADD").role = site.role
        row.operator(SEIP_OT_take_out_of_role.bl_idname, icon="REMOVE").role = site.role
        reason = why_no_role(context)
        if reason:
            draw_sentence(layout, reason, icon="INFO")
        if Role[site.role] in roles.AREAS:
            row = layout.column(align=True) if is_narrow(context) else layout.row(align=True)
            for place, text in (("CURSOR", "Draw at Cursor"), ("VIEW", "Draw in View")):
                button = row.operator(SEIP_OT_add_area.bl_idname, text=text)
                button.role, button.place = site.role, place
        if context.object is not None:
            _draw_object(layout, context.scene, context.object)


def _draw_object(layout: bpy.types.UILayout, scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    assigned = roles.roles_of(scene, obj)
    box = layout.box()
    box.label(text=obj.name, icon="OBJECT_DATA")
    draw_sentence(box, ", ".join(role.value for role in assigned).capitalize() or "No role")
    column = settings_column(box)
    column.enabled = obj.is_editable
    if Role.WEIGHTED_REGIONS in assigned:
        column.prop(obj, "seip_region_weight")
    if Role.POLES in assigned:
        column.prop(obj, "seip_pole_rule")


class SEIP_UL_problems(RowList, bpy.types.UIList):
    """Problems that the check found."""

    bl_idname = "SEIP_UL_problems"

    def draw_row(self, layout: bpy.types.UILayout, item: bpy.types.PropertyGroup) -> None:
        """Draw one."""
        layout.label(text=item.name or item.text, icon="CANCEL" if item.is_error else "ERROR", translate=False)


class SEIP_PT_site_check(Sidebar, bpy.types.Panel):
    """Whether the site is sound."""

    bl_idname = "SEIP_PT_site_check"
    bl_parent_id = "SEIP_PT_site"
    bl_label = "Check"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw what was counted, and the problems."""
        site = context.scene.seip.site
        layout = self.layout
        draw_run(layout, SEIP_OT_check_site.bl_idname)
        if not site.checked:
            return
        doubt = scene_status.stale_check(context.scene)
        if doubt:
            draw_sentence(layout, doubt, icon="ERROR")
        if not site.problems:
            layout.label(text="No problem found", icon="NONE" if doubt else "CHECKMARK")
        else:
            layout.template_list(
                SEIP_UL_problems.bl_idname,
                "",
                site,
                "problems",
                site,
                "active_problem",
                rows=min(5, len(site.problems)),
            )
            if 0 <= site.active_problem < len(site.problems):
                draw_sentence(layout, site.problems[site.active_problem].text)
                layout.operator(SEIP_OT_show_problem.bl_idname, icon="ZOOM_SELECTED")
        counted = layout.column()
        counted.active = not doubt
        for one in site.counts:
            draw_sentence(counted, f"{one.name}: {one.value}")


CLASSES = (SEIP_PT_site, SEIP_PT_site_map, SEIP_PT_site_roles, SEIP_UL_problems, SEIP_PT_site_check)
