"""The step "Site": map or example, roles of objects, and problems that the check found."""

from __future__ import annotations

import bpy

from .. import preferences
from ..core.output.results.answer import sentence
from ..core.site.roles import Role
from ..operators.base import Outcome
from ..operators.site import SEIP_OT_build_site, in_short, is_of_choice, missing_for_build
from ..properties.site import SEIP_PG_site
from ..scene import roles
from ..state import scene_status
from ..state.session import session
from . import sumo
from .sections import Status, draw_sections
from .sidebar import draw_path, draw_reason, draw_run, draw_settings, settings_column
from .wrapped_text import ICON, MARGIN, draw_lines, draw_sentence, wrapped

TARGETS = "Targets"
"""Count of the check that the header shows."""
DIALOG_WIDTH = 420
"""Width of the dialog of an import, pixels at the usual scale of the interface."""
MESSAGE_LINES = 5
"""Lines of that dialog for a message: as many as the longest takes."""
SHOW_WIDTH = 28.0
"""Width of the button next to a problem, pixels at the usual scale of the interface."""


def status(scene: bpy.types.Scene) -> Status:
    """Return the problems that the check found, the number of targets and the name of the site for the header."""
    if scene_status.has_nothing(scene):
        return Status(result=("none yet",))
    check = session.of(scene).check
    if check is None:
        return Status(result=("not checked", scene.name))
    targets = (f"{value.partition(', ')[0]} points" for what, value in check.found.counts.items() if what == TARGETS)
    changed = scene_status.stale_check(scene) not in {"", scene_status.OTHER_SENSORS}
    return Status(changed, (in_short(check.found.problems), *targets, scene.name))


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the choice of a map while there is no site, otherwise the check and its problems."""
    scene = context.scene
    if scene_status.has_nothing(scene):
        ways = "Paste a place, choose a map, load the example, or give roles to your own objects."
        draw_sentence(layout, ways, icon="INFO")
        _draw_map(layout, scene)
        draw_run(layout, "seip.load_example", icon="MOD_BUILD")
    else:
        _draw_check(layout, scene)
        draw_sections(layout, {"contents": _draw_contents, "change_site": _draw_map}, scene)
    draw_sections(layout, {"roles": _draw_roles}, context)


def _draw_map(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    site = scene.seip.site
    name = bpy.path.basename(site.source)
    _draw_download(layout, site)
    draw_run(layout, "seip.choose_map", icon="FILE_FOLDER", text=name or "Choose Map…")
    if not name:
        return
    if len(site.junctions) > 1:
        layout.operator("seip.choose_map", icon="VIEWZOOM", text="Pick on Map…").filepath = site.source
    if site.is_extract():
        sumo.draw_missing(layout)
    _draw_place(layout, site)
    draw_sentence(layout, _place_text(site), icon="INFO")
    draw_sections(layout, {"sources": _draw_sources}, site)
    if not (scene_status.has_nothing(scene) or missing_for_build(scene)):
        again = "The site is built again; your own objects and the sensors stay."
        elsewhere = "The site is built in a new scene; this one stays."
        draw_sentence(layout, again if is_of_choice(scene) else elsewhere, icon="INFO")
    draw_run(layout, "seip.build_site")


def _draw_download(layout: bpy.types.UILayout, site: SEIP_PG_site) -> None:
    """Draw the field for the position of a new site, and the button that downloads its surroundings."""
    row = settings_column(layout).row()
    row.alert = bool(site.new_site and site.wrong_position(site.new_site))
    row.prop(site, "new_site")
    if site.new_site:
        reason = preferences.why_no_download()
        if reason:
            draw_sentence(layout, f"{reason}.", icon="ERROR")
        draw_run(layout, "seip.download_map", icon="WORLD")


class SEIP_OT_choose_place(bpy.types.Operator):
    """Choose the junction of the site, and the length of its streets"""

    bl_idname = "seip.choose_place"
    bl_label = "Import Site"
    bl_options = {"INTERNAL"}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> Outcome:
        """Ask."""
        outcome: Outcome = context.window_manager.invoke_props_dialog(
            self, width=DIALOG_WIDTH, confirm_text=SEIP_OT_build_site.bl_label
        )
        return outcome

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the file, the choice of the place, and what is missing: no choice adds or removes a row."""
        site, layout = context.scene.seip.site, self.layout
        layout.label(text=bpy.path.basename(site.source), icon="FILE", translate=False)
        _draw_place(layout, site)
        _draw_sources(layout, site)
        if site.is_extract() and preferences.sumo() is None:
            sumo.draw_installation(layout, in_one_row=True)
        elif site.is_extract():
            layout.label(text="SUMO lays out the streets.", icon="CHECKMARK")
        missing = missing_for_build(context.scene)
        if missing == preferences.NO_SUMO and preferences.why_no_installation():
            missing = f"{missing}. {preferences.why_no_installation()}"
        text, icon = (f"{missing}.", "ERROR") if missing else (_place_text(site), "INFO")
        lines = wrapped(text, MARGIN + ICON, DIALOG_WIDTH)
        draw_lines(layout, lines + [""] * (MESSAGE_LINES - len(lines)), icon)

    def execute(self, context: bpy.types.Context) -> Outcome:
        """Build the site, or show the dialog again, with what is missing."""
        if missing_for_build(context.scene) and not bpy.app.background:
            bpy.ops.seip.choose_place("INVOKE_DEFAULT")
            return {"CANCELLED"}
        bpy.ops.seip.build_site("INVOKE_DEFAULT")
        return {"FINISHED"}


def _draw_place(layout: bpy.types.UILayout, site: SEIP_PG_site) -> None:
    """Draw the choice of a place in the chosen file and how large the site is."""
    column = settings_column(layout)
    column.prop_search(site, "junction", site, "junctions", icon="DECORATE_DRIVER")
    if site.is_extract():
        row = column.row()
        row.enabled = not site.junction
        row.alert = bool(not site.junction and site.position and site.wrong_position(site.position))
        row.prop(site, "position")
    size = column.column()
    size.enabled = not site.is_described()
    shape = size.row()
    shape.enabled = bool(site.junction) or site.is_extract()
    shape.prop(site, "region_shape")
    size.prop(site, "radius", text="Along Streets" if site.follows_approaches() else "Radius")


def _draw_sources(layout: bpy.types.UILayout, site: SEIP_PG_site) -> None:
    """Draw further files of the site."""
    row = layout.row()
    row.enabled = not site.is_extract()  # which has its own buildings, trees and posts
    draw_path(row, site, "osm")
    draw_path(layout, site, "terrain")
    draw_settings(layout, site, "terrain_epsg").enabled = bool(site.terrain)


def _place_text(site: SEIP_PG_site) -> str:
    """Return which place is chosen, or what is wrong with the choice."""
    if site.junction:
        return "The site is at this junction."
    if site.is_described():
        return "The site is at the place that the description gives."
    if not site.is_extract():
        return "The site is in the middle of the map."
    if not site.position:
        return "Choose a junction, or enter a position."
    wrong = site.wrong_position(site.position)
    return f"{wrong}." if wrong else "The site is at this position."


def _draw_check(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw the button and one line, and the problems with a button each."""
    check = session.of(scene).check
    draw_run(layout, "seip.check_site")
    if check is None:
        return
    problems = check.found.problems
    doubt = scene_status.stale_check(scene)
    if doubt:
        draw_sentence(layout, doubt, icon="INFO" if doubt == scene_status.OTHER_SENSORS else "ERROR")
    elif not problems:
        draw_sentence(layout, "The site is sound.", icon="CHECKMARK")
    else:
        draw_sentence(layout, f"{in_short(problems)}:")
    column = layout.column()
    column.active = not doubt
    for problem in problems:
        row = column.row()
        icon = "CANCEL" if problem.severity == "ERROR" else "ERROR"
        draw_sentence(row.column(), sentence(problem.text), icon=icon, reserved=SHOW_WIDTH)
        button = row.row()
        button.enabled = bool(problem.obj)
        button.operator("seip.show_problem", text="", icon="ZOOM_SELECTED").object = problem.obj


def _draw_contents(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    check = session.of(scene).check
    draw_reason(layout, "" if check is not None else "Check the site to count its contents.")
    for what, value in check.found.counts.items() if check is not None else ():
        draw_sentence(layout, f"{what}: {value}")


def _draw_roles(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the buttons that change roles, then what the active object is: nothing above it moves."""
    site = context.scene.seip.site
    layout.prop(site, "role", text="")
    row = layout.row(align=True)
    row.operator("seip.assign_role", icon="ADD").role = site.role
    button = row.operator("seip.assign_role", text="Remove", icon="REMOVE")
    button.role, button.remove = site.role, True
    if Role[site.role] in roles.AREAS:
        layout.operator("seip.add_area").role = site.role
    if not draw_reason(layout, "" if context.object else "Select objects to give them a role."):
        _draw_object(layout, context.scene, context.object)


def _draw_object(layout: bpy.types.UILayout, scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    assigned = roles.roles_of(scene, obj)
    what = ", ".join(role.value for role in assigned) or "no role"
    draw_sentence(layout, f"{obj.name}: {what}", icon="OBJECT_DATA")
    column = settings_column(layout)
    column.enabled = obj.is_editable
    if Role.WEIGHTED_REGIONS in assigned:
        column.prop(obj, "seip_region_weight")
    if Role.POLES in assigned:
        column.prop(obj, "seip_pole_rule")
