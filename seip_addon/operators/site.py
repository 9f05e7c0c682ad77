"""Operators on the site: build from a map, assign roles, check."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path

import bpy

from .. import scene_status, sensor_types
from ..core.errors import SeipError
from ..core.opendrive import read_map
from ..core.opendrive.road_map import RoadMap
from ..core.progress import Progress, finish
from ..core.site.check import Problem, SiteCheck, check_site
from ..core.site.scene_geometry import SceneGeometry
from ..core.site.site import Site
from ..core.streetscape.description import DEFAULT_RADIUS, DESCRIPTION_SUFFIX, describe_place
from ..core.streetscape.parts import Role
from ..core.workflows.site_building import AskedSite, BuiltSite, build_site
from ..core.workflows.survey import SurveySettings, lay_out
from ..properties.site import ROLE_ITEMS, SEIP_PG_site
from ..scene import contract, roles
from ..scene.build import build_scene
from ..scene.changes import watch
from ..scene.check import contents_of
from ..session import CheckedScene, session
from .base import LongWork, Outcome, attempt

SHARE_OF_VIEW = 0.6
"""Of a drawn area in the size of the view."""
AREA_ITEMS = tuple(item for item in ROLE_ITEMS if Role[item[0]] in roles.AREAS)


class SEIP_OT_choose_map(bpy.types.Operator):
    """Choose an OpenDRIVE map (.xodr), or a site description (.toml) that names one, and list its junctions"""

    bl_idname = "seip.choose_map"
    bl_label = "Choose Map"
    bl_options = {"REGISTER", "UNDO"}

    filepath: bpy.props.StringProperty(name="File", description="The map or site description", subtype="FILE_PATH")
    filter_glob: bpy.props.StringProperty(default=f"*.xodr;*{DESCRIPTION_SUFFIX}", options={"HIDDEN"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> Outcome:
        """Open the file browser."""
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> Outcome:
        """Read the map's junctions."""
        return attempt(self, lambda: self._choose(context.scene.seip.site))

    def _choose(self, site: SEIP_PG_site) -> None:
        path = Path(bpy.path.abspath(self.filepath))
        map_path, description = describe_place(path)
        road_map = read_map(map_path)
        site.source = self.filepath
        site.radius = description.radius or DEFAULT_RADIUS
        list_junctions(site, road_map)
        self.report({"INFO"}, f"{len(road_map.roads):,} roads, {len(site.junctions):,} junctions")


def list_junctions(site: SEIP_PG_site, road_map: RoadMap) -> None:
    """List the junctions that a site can be built round, in place of those of another map."""
    site.junction = ""
    site.junctions.clear()
    for junction in road_map.junctions_with_roads():
        one = site.junctions.add()
        one.id = junction.id
        one.name = f"{junction.id} {junction.name}".strip()


class SEIP_OT_build_site(LongWork[BuiltSite], bpy.types.Operator):
    """Model the chosen place of the map: in this scene with its camera, light and units, or in a new scene of this file where this one has a site already"""  # noqa: E501  # a tooltip is one line

    bl_idname = "seip.build_site"
    bl_label = "Build Site"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return whether a map is chosen."""
        missing = missing_for_build(context.scene)
        if missing:
            cls.poll_message_set(missing)
        return not missing

    def prepare(self, scene: bpy.types.Scene) -> Generator[Progress, None, BuiltSite]:
        """Take what was chosen."""
        site = scene.seip.site
        junction = site.junction_id()
        size = None if site.is_described() else float(f"{site.radius:.7g}")
        radius, approaches = (None, size) if site.follows_approaches() else (size, None)
        chosen = () if junction is None else (junction,)
        asked = AskedSite(junction=chosen, radius=radius, approaches=approaches, anywhere=True)
        return build_site(Path(bpy.path.abspath(site.source)), asked)

    def conclude(self, scene: bpy.types.Scene, result: BuiltSite) -> None:
        """Build the scene."""
        chosen = scene.seip.site
        built = scene
        if has_site(scene):
            built = bpy.data.scenes.new(result.model.name)
            for name in ("source", "region_shape", "radius"):
                setattr(built.seip.site, name, getattr(chosen, name))
            for junction in chosen.junctions:
                one = built.seip.site.junctions.add()
                one.name, one.id = junction.name, junction.id
            built.seip.site.junction = chosen.junction
            sensor_types.list_types(built)
        finish(build_scene(built, result.model, result.map_name))
        if bpy.context.window is not None:
            bpy.context.window.scene = built
        for note in result.model.notes:
            self.report({"INFO"}, note)
        for warning in result.model.warnings:
            self.report({"WARNING"}, warning)
        self.report({"INFO"}, f"{len(result.model.parts)} objects, region {result.model.region.area:,.0f} m²")


def missing_for_build(scene: bpy.types.Scene) -> str:
    """Say what is missing before a site can be built, or nothing."""
    return "" if scene.seip.site.source else "Choose a map first"


def has_site(scene: bpy.types.Scene) -> bool:
    """Return whether a scene has any of the collections that a site is read from."""
    return any(contract.kind(collection) in contract.INPUTS for collection in scene.collection.children_recursive)


class _RoleOperator:
    """A mixin for operators on the selected objects and a role."""

    bl_options = {"REGISTER", "UNDO"}

    role: bpy.props.EnumProperty(name="Role", description="What the objects mean to the placement", items=ROLE_ITEMS)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return whether anything is selected."""
        reason = why_no_role(context)
        if reason:
            cls.poll_message_set(reason)  # type: ignore[attr-defined]  # of Blender's operators
        return not reason


NOTHING_SELECTED = "Select objects first"


def why_no_role(context: bpy.types.Context) -> str:
    """Say why no role can be given or taken, or nothing."""
    if scene_status.is_linked(context.scene):
        return scene_status.LINKED
    return "" if context.selected_objects else NOTHING_SELECTED


class SEIP_OT_assign_role(_RoleOperator, bpy.types.Operator):
    """Link the selected objects to the collection of a role; other roles and collections stay"""

    bl_idname = "seip.assign_role"
    bl_label = "Assign"

    def execute(self, context: bpy.types.Context) -> Outcome:
        """Link them."""
        return attempt(self, lambda: self._assign(context, Role[self.role]))

    def _assign(self, context: bpy.types.Context, role: Role) -> None:
        count = roles.assign(context.scene, context.selected_objects, role)
        self.report({"INFO"}, f"{count} assigned to the {role.value}")


class SEIP_OT_take_out_of_role(_RoleOperator, bpy.types.Operator):
    """Unlink the selected objects from the collections of a role; other roles and collections stay"""

    bl_idname = "seip.take_out_of_role"
    bl_label = "Remove"

    def execute(self, context: bpy.types.Context) -> Outcome:
        """Unlink them."""
        return attempt(self, lambda: self._take_out(context, Role[self.role]))

    def _take_out(self, context: bpy.types.Context, role: Role) -> None:
        count = roles.take_out(context.scene, context.selected_objects, role)
        self.report({"INFO"}, f"{count} taken out of the {role.value}")


class SEIP_OT_add_area(bpy.types.Operator):
    """Add a flat area in a role, at the 3D cursor or in the middle of the view; go into Edit Mode to shape it"""

    bl_idname = "seip.add_area"
    bl_label = "Draw Area"
    bl_options = {"REGISTER", "UNDO"}

    role: bpy.props.EnumProperty(
        name="Role",
        description="What the area means to the placement",
        items=AREA_ITEMS,
    )
    place: bpy.props.EnumProperty(
        name="Place",
        description="Where the area is laid",
        items=(
            ("VIEW", "View", "In the middle of the view, as large as most of it, at the height of the 3D cursor"),
            ("CURSOR", "3D Cursor", "At the 3D cursor"),
        ),
        default="CURSOR",
    )
    size: bpy.props.FloatVectorProperty(
        name="Size", description="Along x and y", size=2, unit="LENGTH", default=(40.0, 40.0), min=0.1, soft_max=500.0
    )
    turn: bpy.props.FloatProperty(name="Rotation", description="Counter-clockwise", subtype="ANGLE")
    corners: bpy.props.IntProperty(
        name="Corners", description="Four make a rectangle, more an ellipse", default=4, min=3, soft_max=32, max=360
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return whether objects can be added."""
        reason = scene_status.LINKED if scene_status.is_linked(context.scene) else ""
        if not reason and context.mode != "OBJECT":
            reason = "Leave Edit Mode first"
        if reason:
            cls.poll_message_set(reason)
        return not reason

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> Outcome:
        """Take the size from the view where the area is laid there."""
        view = context.region_data
        if self.place == "VIEW" and view is not None:
            side = max(1.0, round(SHARE_OF_VIEW * view.view_distance))
            self.size = (side, side)
        return self.execute(context)

    def execute(self, context: bpy.types.Context) -> Outcome:
        """Add it, selected and active."""
        middle = context.scene.cursor.location.copy()
        if self.place == "VIEW" and context.region_data is not None:
            middle.xy = context.region_data.view_location.xy
        obj = roles.add_area(context.scene, Role[self.role], tuple(middle), tuple(self.size), self.turn, self.corners)
        _select_alone(context, obj)
        return {"FINISHED"}


class SEIP_OT_check_site(LongWork[SiteCheck], bpy.types.Operator):
    """Count what the scene holds by role, and list what stops a survey or harms its answer"""

    bl_idname = "seip.check_site"
    bl_label = "Check Site"

    def prepare(self, scene: bpy.types.Scene) -> Generator[Progress, None, SiteCheck]:
        """Read the scene as it is now."""
        self._check = CheckedScene(watch(scene), scene_status.checked_settings(scene))
        contents = contents_of(scene)
        settings: SurveySettings | SeipError
        try:
            settings = scene.seip.survey.settings()
        except SeipError as error:
            settings = error
        return check_site(contents, lambda geometry: _laid_out(geometry, settings))

    def conclude(self, scene: bpy.types.Scene, result: SiteCheck) -> None:
        """List what was found."""
        session.checks[scene.session_uid] = self._check
        site = scene.seip.site
        site.checked = True
        site.counts.clear()
        for what, value in result.counts.items():
            one = site.counts.add()
            one.name, one.value = what, value
        site.problems.clear()
        for problem in result.problems:
            listed = site.problems.add()
            listed.name, listed.text, listed.is_error = problem.obj, problem.text, problem.severity == "ERROR"
        self.report({"INFO"}, in_short(result.problems))


def _laid_out(geometry: SceneGeometry, settings: SurveySettings | SeipError) -> tuple[Site, tuple[str, ...]]:
    if isinstance(settings, SeipError):
        raise settings
    layout = lay_out(geometry, settings)
    return layout.site, layout.warnings


def in_short(problems: tuple[Problem, ...]) -> str:
    """Return how many errors and warnings there are, in words."""
    errors = sum(problem.severity == "ERROR" for problem in problems)
    warnings = len(problems) - errors
    return f"{errors} error{'s' * (errors != 1)}, {warnings} warning{'s' * (warnings != 1)}"


class SEIP_OT_show_problem(bpy.types.Operator):
    """Select the object that the problem is about, and bring it into view"""

    bl_idname = "seip.show_problem"
    bl_label = "Show Object"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return whether there is an object to be shown."""
        nothing = nothing_to_show(context)
        if nothing:
            cls.poll_message_set(nothing)
        return not nothing

    def execute(self, context: bpy.types.Context) -> Outcome:
        """Select it alone, and frame it."""
        site = context.scene.seip.site
        obj = context.view_layer.objects[site.problems[site.active_problem].name]
        _select_alone(context, obj)
        _frame_selected(context)
        return {"FINISHED"}


def nothing_to_show(context: bpy.types.Context) -> str:
    """Say why the active problem's object cannot be shown, or nothing."""
    site = context.scene.seip.site
    if not 0 <= site.active_problem < len(site.problems):
        return "No problem is selected"
    name = site.problems[site.active_problem].name
    if not name:
        return "This concerns the whole scene"
    obj = context.view_layer.objects.get(name)
    if obj is None:
        return "The object is not in this view layer"
    if not obj.visible_get():
        return "The object is hidden: show it first"
    return "" if context.mode == "OBJECT" else "Leave Edit Mode first"


def _select_alone(context: bpy.types.Context, obj: bpy.types.Object) -> None:
    for other in context.selected_objects:
        other.select_set(state=False)
    obj.select_set(state=True)
    context.view_layer.objects.active = obj


def _frame_selected(context: bpy.types.Context) -> None:
    """Bring what is selected into the 3D view that was clicked in."""
    area = context.area
    if area is None or area.type != "VIEW_3D":
        return
    region = next(region for region in area.regions if region.type == "WINDOW")
    with context.temp_override(region=region):
        bpy.ops.view3d.view_selected()


CLASSES = (
    SEIP_OT_choose_map,
    SEIP_OT_build_site,
    SEIP_OT_assign_role,
    SEIP_OT_take_out_of_role,
    SEIP_OT_add_area,
    SEIP_OT_check_site,
    SEIP_OT_show_problem,
)
