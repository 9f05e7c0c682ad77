"""The step "Site": its sources, the choice of a place, and building its model."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path
from typing import Any

import bpy
from bpy.props import CollectionProperty, EnumProperty, FloatProperty, StringProperty

from ..core.base.counts import counted
from ..core.base.progress import Progress, finish
from ..core.programs.sumo_programs import NETWORK_SUFFIX
from ..core.workflows.site_building import BuiltSite, SiteRequest, build_site, site_source
from ..core.workflows.site_places import SitePlaces, site_places
from ..core.world.openstreetmap.map_links import parsed_position
from ..core.world.openstreetmap.site import is_extract
from ..core.world.streetscape.description import DEFAULT_RADIUS
from ..core.world.streetscape.site_file import DESCRIPTION_SUFFIX
from ..scene import contract
from ..scene.build import build_scene, remove_site, remove_startup_objects
from ..scene.views import frame_site
from . import overlays, preferences, scene_status, sensors, traffic
from .layout import draw_path, draw_run, draw_sections, draw_sentence, settings_column
from .object_roles import ROLE_ITEMS, WritesScene, draw_roles
from .preferences import overpass, sumo_folders
from .properties import absolute, as_typed, complaint, of_setting, path_property
from .session import session
from .site_check import draw_check, draw_contents
from .work import Job, LongWork, Outcome

_FILE = {"subtype": "FILE_PATH", "options": {"PATH_SUPPORTS_BLEND_RELATIVE"}}
EXTRACTS = "*.osm;*.osm.gz;*.osm.pbf"
"""Files of OpenStreetMap, as the file browser filters them."""
NO_NEW_SITE = "Paste latitude and longitude, or a link of a web map, into New Site"
NO_PLACE = "Choose a junction, or give latitude and longitude"
COPIED = ("source", "position", "region_shape", "radius", "osm", "terrain")
"""Properties of a choice that a site in a new scene takes over."""


class SEIP_PG_junction(bpy.types.PropertyGroup):
    """A junction of the chosen file, named as in the list."""

    id: StringProperty(name="Id", description="Junction id in the map, or latitude and longitude")


class SEIP_PG_site(bpy.types.PropertyGroup):
    """Sources of the site."""

    source: path_property("Map", "OpenDRIVE map, site description that names one, or extract of OpenStreetMap")
    new_site: StringProperty(
        name="New Site",
        description="Position of a place whose streets are downloaded from OpenStreetMap: latitude and longitude in "
        "degrees, or a link of OpenStreetMap, Google, Bing or Apple maps",
    )
    junctions: CollectionProperty(type=SEIP_PG_junction)
    junction: StringProperty(
        name="Junction",
        description="Junction in the middle of the site, by its streets: type to search. Empty for the middle "
        "of the map, or the description's own place",
    )
    position: StringProperty(
        name="Lat, Lon",
        description="Latitude and longitude in degrees, as maps in the browser give them: 52.47391, 13.44048. The "
        "junction nearest to it is in the middle of the site, or the place itself with a circle",
    )
    region_shape: EnumProperty(
        name="Region",
        description="Part of the road around the junction to cover",
        items=(
            ("APPROACHES", "Approaches", "The junction, and the streets that lead to it up to a distance along them"),
            ("CIRCLE", "Circle", "All road within a circle about the middle of the junction"),
        ),
    )
    radius: FloatProperty(
        name="Radius",
        description="Radius of the region of interest, or its length along the approaches of the junction",
        unit="LENGTH",
        default=DEFAULT_RADIUS,
        min=1.0,
        soft_max=500.0,
        step=1000,
    )
    osm: of_setting(SiteRequest, "osm", "Surroundings", **_FILE)
    terrain: of_setting(SiteRequest, "terrain", "Terrain", **_FILE)
    role: EnumProperty(name="Role", description="Role of objects in the placement", items=ROLE_ITEMS)

    def is_described(self) -> bool:
        """Return whether a site description gives the place and its size."""
        return self.source.lower().endswith(DESCRIPTION_SUFFIX) and not self.junction

    def is_extract(self) -> bool:
        """Return whether the site comes from an extract of OpenStreetMap."""
        return is_extract(Path(self.source))

    def wrong_position(self, text: str) -> str:
        """Return what is wrong with a position, or ""."""
        return complaint(lambda: parsed_position(text))

    def has_place(self) -> bool:
        """Return whether enough is chosen to build a site: a map has a middle, an extract none."""
        return bool(self.source and (self.junction or self.position or not self.is_extract()))

    def place(self) -> str:
        """Return the chosen junction or place with its map, as one text."""
        return "|".join((self.source, self.junction or self.position))

    def follows_approaches(self) -> bool:
        """Return whether the region follows the approaches of a junction."""
        return (bool(self.junction) or self.is_extract()) and self.region_shape == "APPROACHES"

    def request(self) -> SiteRequest:
        """Return the request as the core takes it.

        Raises
        ------
        SeipError
            The position is invalid.
        """
        size = None if self.is_described() else as_typed(self.radius)
        radius, approaches = (None, size) if self.follows_approaches() else (size, None)
        more = self._sources()
        found = self.junctions.get(self.junction)
        chosen = self.junction if found is None else found.id
        if not self.is_extract():
            junction = (chosen,) if chosen else ()
            return SiteRequest(junction=junction, radius=radius, approaches=approaches, anywhere=True, **more)
        near = parsed_position(chosen or self.position)
        more |= {"sumo": sumo_folders(), "overpass": overpass()}
        return SiteRequest(near_latlon=near, radius=radius, approaches=approaches, **more)

    def _sources(self) -> dict[str, Any]:
        """Return the fields of the request that name further files."""
        terrain = absolute(self.terrain) if self.terrain else None
        osm = absolute(self.osm) if self.osm and not self.is_extract() else None
        return {"osm": osm, "terrain": terrain}


class SEIP_OT_choose_map(WritesScene, LongWork, bpy.types.Operator):
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
        scene, found = yield site_places(absolute(self.filepath))
        site = scene.seip.site
        _list_places(site, self.filepath, found)
        self.report({"INFO"}, counted(len(site.junctions), "junction"))
        if self.by_hand and not bpy.app.background:
            self._ask(site, found)

    def _ask(self, site: SEIP_PG_site, found: SitePlaces) -> None:
        """Ask for the place in the sidebar; where a file has several junctions, on the map."""
        sections = bpy.context.window_manager.seip_sections
        sections.site = sections.change_site = True
        overlays.open_sidebar(bpy.context.window)
        if len(found.places) == 1 and not site.is_described():
            site.junction = found.places[0].name
        elif not site.is_described() and bpy.ops.seip.pick_junction.poll():
            bpy.ops.seip.pick_junction("INVOKE_DEFAULT")


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


class SEIP_OT_download_map(WritesScene, LongWork, bpy.types.Operator):
    """Download the streets, buildings and trees around the place from OpenStreetMap, and choose the place there. A download of the same day is used again"""  # noqa: E501  # a tooltip is one line

    stopped_message = "stopped; nothing was downloaded"

    obstacles = (
        *WritesScene.obstacles,
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


class _BuildsSite(WritesScene, LongWork):
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
        self.warn(result.model.warnings)
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
            sensors.list_types(new)
            return new
        if remove_startup_objects(scene):
            self.report({"INFO"}, "Blender's cube, light and camera were removed")  # type: ignore[attr-defined]  # of Blender's operators
        return scene


class SEIP_OT_build_site(_BuildsSite, bpy.types.Operator):
    """Build a model of the chosen place, with camera, light and units. It replaces an earlier site of the same place; your own objects stay. If this scene has a site of another place, a new scene is made. Blender's default cube, light and camera are removed if the scene holds nothing else"""  # noqa: E501  # a tooltip is one line

    obstacles = (missing_for_build, *WritesScene.obstacles)

    def job(self, scene: bpy.types.Scene) -> Job:
        """Build what was chosen."""
        site = scene.seip.site
        self._build(*(yield build_site(absolute(site.source), site.request())))


class SEIP_OT_load_example(_BuildsSite, bpy.types.Operator):
    """Build the junction that comes with SEIP: in this scene, or in a new scene of this file where this one has a site already"""  # noqa: E501  # a tooltip is one line

    is_chosen = False

    def job(self, _scene: bpy.types.Scene) -> Job:
        """Build the example, whose description says all."""
        self._build(*(yield build_site(traffic.EXAMPLE_SITE, SiteRequest())))


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


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the choice of a map while there is no site, otherwise the check and its problems."""
    scene = context.scene
    if scene_status.has_nothing(scene):
        ways = "Paste a place, choose a map, load the example, or give roles to your own objects."
        draw_sentence(layout, ways, icon="INFO")
        _draw_map(layout, scene)
        draw_run(layout, "seip.load_example", icon="MOD_BUILD")
    else:
        draw_check(layout, scene)
        draw_sections(layout, {"contents": draw_contents, "change_site": _draw_map}, scene)
    draw_sections(layout, {"roles": draw_roles}, context)


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
        preferences.draw_missing(layout)
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
