"""Operators on the site: build from a map, assign roles, check."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from pathlib import Path

import bpy

from .. import preferences
from ..core.base.counts import counted
from ..core.base.errors import SeipError
from ..core.base.progress import Progress, finish
from ..core.output.results.placement_record import relevant_warnings
from ..core.programs.sumo_programs import NETWORK_SUFFIX
from ..core.site.check import Problem, SceneContents, SiteCheck, check_site
from ..core.site.roles import Role
from ..core.site.scene_geometry import SceneGeometry
from ..core.site.site import Site
from ..core.workflows.site_building import BuiltSite, SiteRequest, build_site, site_source
from ..core.workflows.site_places import SitePlaces, site_places
from ..core.workflows.survey import lay_out
from ..core.workflows.survey_settings import SurveySettings
from ..core.world.openstreetmap.map_links import parsed_position
from ..core.world.streetscape.site_file import DESCRIPTION_SUFFIX
from ..properties import traffic
from ..properties.conversion import absolute, complaint
from ..properties.site import ROLE_ITEMS, SEIP_PG_site
from ..scene import contract, roles
from ..scene.build import build_scene, remove_site
from ..scene.changes import watch
from ..scene.check import contents_of
from ..scene.startup import remove_startup_objects
from ..scene.views import frame_site
from ..state import scene_status, selection, sensor_types
from ..state.session import CheckedScene, session
from ..viewport import overlays
from .base import Conditional, Job, LongWork, Obstacles, Outcome, ShortWork

EXAMPLE = Path(__file__).resolve().parents[2] / "scenes" / f"junction{DESCRIPTION_SUFFIX}"
"""The site that comes with SEIP: beside the package, in a checkout as in the extension."""
EXTRACTS = "*.osm;*.osm.gz;*.osm.pbf"
"""Files of OpenStreetMap, as the file browser filters them."""
NO_NEW_SITE = "Paste latitude and longitude, or a link of a web map, into New Site"
NO_PLACE = "Choose a junction, or give latitude and longitude"
COPIED = ("source", "position", "region_shape", "radius", "osm", "terrain", "terrain_epsg")
"""Properties of a choice that a site in a new scene takes over."""
AREA_ITEMS = tuple(item for item in ROLE_ITEMS if Role[item[0]] in roles.AREAS)


class _WritesScene(Conditional):
    """A mixin for operators that write into the scene, which must belong to the open file."""

    obstacles: Obstacles = (scene_status.not_own,)


class SEIP_OT_choose_map(_WritesScene, LongWork, bpy.types.Operator):
    """Choose an OpenDRIVE map (.xodr), an extract of OpenStreetMap (.osm, .osm.gz, .osm.pbf) or a site description (.toml), and choose among its junctions"""  # noqa: E501  # a tooltip is one line

    filepath: bpy.props.StringProperty(
        name="File",
        description="Map, extract or site description",
        subtype="FILE_PATH",
        options={"SKIP_SAVE", "PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    filter_glob: bpy.props.StringProperty(
        default=f"*.xodr;*{DESCRIPTION_SUFFIX};{EXTRACTS}", options={"HIDDEN", "SKIP_SAVE"}
    )
    by_hand = False

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event | None) -> Outcome:
        """Open the file browser, unless a file was dropped."""
        self.by_hand = True
        if self.filepath:
            return super().invoke(context, event)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> Outcome:
        """List the file's junctions: in a thread where the file browser asks, at once where a script does."""
        return super().invoke(context, None) if self.by_hand and not bpy.app.background else super().execute(context)

    def job(self, scene: bpy.types.Scene) -> Job:
        """Read the file, list its junctions in place of those of another file, and ask for the place."""
        scene, found = yield site_places(Path(bpy.path.abspath(self.filepath)))
        site = scene.seip.site
        _list_places(site, self.filepath, found)
        self.report({"INFO"}, counted(len(site.junctions), "junction"))
        if self.by_hand and not bpy.app.background:
            self._ask(site, found)

    def _ask(self, site: SEIP_PG_site, found: SitePlaces) -> None:
        """Ask for the place: on the map, or in a dialog where a description or the only junction gives it."""
        if len(found.places) == 1 and not site.is_described():
            site.junction = found.places[0].name
        elif not site.is_described() and bpy.ops.seip.pick_junction.poll():
            bpy.ops.seip.pick_junction("INVOKE_DEFAULT")
            return
        bpy.ops.seip.choose_place("INVOKE_DEFAULT")


def _list_places(site: SEIP_PG_site, source: str, places: SitePlaces) -> None:
    """List the junctions of a file in place of those of another one."""
    before = ""
    if site.source == source:
        before = site.junction  # it stays until another one is chosen
    else:
        site.radius, site.position = places.radius, ""
    site.source, site.junction = source, ""
    site.junctions.clear()
    for place in places.places:
        one = site.junctions.add()
        one.name, one.id = place.name, place.key
    site.junction = before if before in site.junctions else ""
    session.places = places


class SEIP_OT_download_map(_WritesScene, LongWork, bpy.types.Operator):
    """Download the streets, buildings and trees around the place from OpenStreetMap, and choose the place there. A download of the same day is used again"""  # noqa: E501  # a tooltip is one line

    stopped_message = "stopped; nothing was downloaded"

    obstacles = (
        *_WritesScene.obstacles,
        lambda scene: "" if scene.seip.site.new_site else NO_NEW_SITE,
        lambda _: preferences.why_no_download(),
    )

    def job(self, scene: bpy.types.Scene) -> Job:
        """Download a site of the usual size, and list its junctions; a larger site downloads more when it is built."""
        near = parsed_position(scene.seip.site.new_site)
        scene, (path, places) = yield _downloaded(SiteRequest(near_latlon=near, overpass=preferences.overpass()))
        site = scene.seip.site
        _list_places(site, str(path), places)
        site.junction, site.position = "", "{:.6f}, {:.6f}".format(*near)
        self.report({"INFO"}, counted(len(site.junctions), "junction"))


def _downloaded(request: SiteRequest) -> Generator[Progress, None, tuple[Path, SitePlaces]]:
    """Download an extract, and list its junctions."""
    path = yield from site_source(request)
    return path, (yield from site_places(path))


def missing_for_build(scene: bpy.types.Scene) -> str:
    """Say what is missing before a site can be built, or nothing."""
    site = scene.seip.site
    if not site.source:
        return "Choose a map first"
    if site.is_extract() and preferences.sumo() is None:
        return preferences.NO_SUMO
    if not site.has_place():
        return NO_PLACE
    return complaint(site.request)


class _BuildsSite(_WritesScene, LongWork):
    """A mixin for operators that build a site."""

    is_chosen = True

    def _build(self, scene: bpy.types.Scene, result: BuiltSite) -> None:
        """Build the scene."""
        report = self.report  # type: ignore[attr-defined]  # of Blender's operators
        built = self._emptied(scene, result.model.name)
        finish(build_scene(built, result.model, result.map_name))
        if self.is_chosen:
            built[contract.BUILT] = built.seip.site.place()
        _keep_map(built, result)
        if not self.is_chosen:
            built.seip.traffic.file = built.seip.simulation.map = traffic.EXAMPLE
        _bring_to_front(built)
        for note in result.model.notes:
            report({"INFO"}, note)
        for warning in result.model.warnings:
            report({"WARNING"}, warning)
        report({"INFO"}, f"{counted(len(result.model.parts), 'object')}, region {result.model.region.area:,.0f} m²")
        if bpy.context.window is not None and not bpy.app.background:
            bpy.ops.seip.check_site("INVOKE_DEFAULT")

    def _emptied(self, scene: bpy.types.Scene, name: str) -> bpy.types.Scene:
        """Return the scene to build in: this one, without an earlier site of the same place, or a new one."""
        if self.is_chosen and is_of_choice(scene):
            remove_site(scene)
            return scene
        if not scene_status.has_nothing(scene):
            new = bpy.data.scenes.new(name)
            if self.is_chosen:
                _copy_choice(scene.seip.site, new.seip.site)
            sensor_types.list_types(new)
            return new
        if remove_startup_objects(scene):
            self.report({"INFO"}, "Blender's cube, light and camera were removed")  # type: ignore[attr-defined]  # of Blender's operators
        return scene


class SEIP_OT_build_site(_BuildsSite, bpy.types.Operator):
    """Build a model of the chosen place, with camera, light and units. It replaces an earlier site of the same place; your own objects stay. If this scene has a site of another place, a new scene is made. Blender's default cube, light and camera are removed if the scene holds nothing else"""  # noqa: E501  # a tooltip is one line

    obstacles = (missing_for_build, *_WritesScene.obstacles)

    def job(self, scene: bpy.types.Scene) -> Job:
        """Build what was chosen."""
        site = scene.seip.site
        self._build(*(yield build_site(Path(bpy.path.abspath(site.source)), site.request())))


class SEIP_OT_load_example(_BuildsSite, bpy.types.Operator):
    """Build the junction that comes with SEIP: in this scene, or in a new scene of this file where this one has a site already"""  # noqa: E501  # a tooltip is one line

    is_chosen = False

    def job(self, _scene: bpy.types.Scene) -> Job:
        """Build the example, whose description says all."""
        self._build(*(yield build_site(EXAMPLE, SiteRequest())))


def _copy_choice(chosen: SEIP_PG_site, site: SEIP_PG_site) -> None:
    for name in COPIED:
        setattr(site, name, getattr(chosen, name))
    for junction in chosen.junctions:
        one = site.junctions.add()
        one.name, one.id = junction.name, junction.id
    site.junction = chosen.junction


def _keep_map(scene: bpy.types.Scene, built: BuiltSite) -> None:
    """Keep the map for the simulation of traffic: its path, or that of an extract's streets as a text in the file."""
    simulation = scene.seip.simulation
    if built.map_text is None:
        source = scene.seip.site.source  # as it was named: relative to the file, or not
        simulation.map = source if absolute(source) == built.map_path else str(built.map_path)
    else:
        name = f"{scene.name}{NETWORK_SUFFIX}"
        if name in bpy.data.texts:  # of the site that this one replaces
            bpy.data.texts.remove(bpy.data.texts[name])
        text = bpy.data.texts.new(name)
        text.from_string(built.map_text)
        simulation.map = text.name


def _bring_to_front(scene: bpy.types.Scene) -> None:
    """Show the site of a scene in the window, with the sidebar beside it."""
    window = bpy.context.window
    if window is None:
        return
    window.scene = scene
    for area in overlays.viewports([window]):
        frame_site(area, scene)
    overlays.open_sidebar(window)


def is_of_choice(scene: bpy.types.Scene) -> bool:
    """Return whether the site of a scene is of the chosen place on the chosen map: a new one replaces it."""
    return not scene_status.has_nothing(scene) and scene.get(contract.BUILT) == scene.seip.site.place()


class SEIP_OT_assign_role(_WritesScene, ShortWork, bpy.types.Operator):
    """Link the selected objects to the collection of a role, or remove them from it; other collections stay"""

    bl_label = "Assign"
    bl_options = {"REGISTER", "UNDO"}

    role: bpy.props.EnumProperty(name="Role", description="Role of the objects in the placement", items=ROLE_ITEMS)
    remove: bpy.props.BoolProperty(name="Remove", description="Take the objects out of the role", default=False)

    @classmethod
    def why_not(cls, context: bpy.types.Context) -> str:
        """Return a reason if nothing is selected or the scene is linked from another file."""
        return super().why_not(context) or ("" if context.selected_objects else "Select objects first")

    def act(self, context: bpy.types.Context) -> None:
        """Link or unlink them."""
        role = Role[self.role]
        change, what = (roles.take_out, "taken out of") if self.remove else (roles.assign, "assigned to")
        self.report({"INFO"}, f"{change(context.scene, context.selected_objects, role)} {what} the {role.value}")


class _InObjectMode(_WritesScene):
    """A mixin for operators that cannot be used in Edit Mode."""

    @classmethod
    def why_not(cls, context: bpy.types.Context) -> str:
        """Return a reason in another mode than Object Mode."""
        return super().why_not(context) or ("" if context.mode == "OBJECT" else "Leave Edit Mode first")


class SEIP_OT_add_area(_InObjectMode, ShortWork, bpy.types.Operator):
    """Add a flat area in a role at the 3D cursor; go into Edit Mode to shape it"""

    bl_label = "Draw Area"
    bl_options = {"REGISTER", "UNDO"}

    role: bpy.props.EnumProperty(name="Role", description="Role of the area in the placement", items=AREA_ITEMS)
    size: bpy.props.FloatVectorProperty(
        name="Size",
        description="Lengths along x and y",
        size=2,
        unit="LENGTH",
        default=(40.0, 40.0),
        min=0.1,
        soft_max=500.0,
    )
    turn: bpy.props.FloatProperty(name="Rotation", description="Counter-clockwise angle", subtype="ANGLE")
    corners: bpy.props.IntProperty(
        name="Corners",
        description="Number of corners: 4 for a rectangle, more for an ellipse",
        default=4,
        min=3,
        soft_max=32,
        max=360,
    )

    def act(self, context: bpy.types.Context) -> None:
        """Add it, selected and active."""
        middle = tuple(context.scene.cursor.location)
        obj = roles.add_area(context.scene, Role[self.role], middle, tuple(self.size), self.turn, self.corners)
        selection.select_alone(context, obj)


class SEIP_OT_check_site(LongWork, bpy.types.Operator):
    """Count the objects by role, and list problems that prevent a placement or make it wrong"""

    def job(self, scene: bpy.types.Scene) -> Job:
        """Check the scene as it is now, and hold what was found."""
        watching, settings = watch(scene), scene_status.survey_settings(scene)
        scene, found = yield _checked(contents_of(scene), settings)
        session.of(scene).check = CheckedScene(found, watching, settings)
        bpy.context.window_manager.seip_sections.follow_steps()
        self.report({"INFO"}, in_short(found.problems))


def _checked(contents: SceneContents, settings: SurveySettings | str) -> Generator[Progress, None, SiteCheck]:
    """Check a scene."""

    def laid_out(geometry: SceneGeometry) -> tuple[Site, tuple[str, ...]]:
        if isinstance(settings, str):
            raise SeipError(settings)
        layout = lay_out(geometry, settings)
        keys = settings.candidates.sensors  # warnings about a type are shown with the type
        return layout.site, tuple(relevant_warnings(layout.warnings, keys, ()))

    return (yield from check_site(contents, laid_out))


def in_short(problems: Iterable[Problem]) -> str:
    """Return the number of errors and warnings as text; "no problem" where there is none."""
    kinds = [problem.severity == "ERROR" for problem in problems]
    errors, warnings = counted(sum(kinds), "error"), counted(len(kinds) - sum(kinds), "warning")
    if not kinds:
        return "no problem"
    return f"{errors}, {warnings}" if any(kinds) else warnings


class SEIP_OT_show_problem(_InObjectMode, ShortWork, bpy.types.Operator):
    """Select the object with the problem, and bring it into view"""

    bl_label = "Show Object"
    bl_options = {"REGISTER", "UNDO"}

    object: bpy.props.StringProperty(name="Object", description="Name of the object")

    def act(self, context: bpy.types.Context) -> None:
        """Select it alone, and frame it."""
        obj = context.view_layer.objects.get(self.object)
        if obj is None:
            raise SeipError(f"the object {self.object!r} is not in this view layer")
        if not obj.visible_get():
            raise SeipError(f"the object {self.object!r} is hidden: show it first")
        selection.select_alone(context, obj)
        if context.area is not None and context.area.type == "VIEW_3D":
            region = next(region for region in context.area.regions if region.type == "WINDOW")
            with context.temp_override(region=region):
                bpy.ops.view3d.view_selected()
