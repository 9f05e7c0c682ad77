"""Operators on a network: import of a whole extract, opening of the site of a junction, and the way back."""

from __future__ import annotations

from pathlib import Path

import bpy

from .. import scene_status, sensor_types
from ..core.counts import counted
from ..core.errors import SeipError
from ..core.output.network.ranked_sites import coverage_level
from ..core.output.pictures.palette import NO_SITE_COLOUR, SHARE_COLOURS
from ..core.output.results.placement_file import parsed_record
from ..core.workflows.site_places import SitePlaces
from ..scene import contract, network
from ..scene.startup import remove_startup_objects
from ..scene.views import frame_plan, frame_site
from ..session import session
from .base import Conditional, Outcome, attempt
from .site import EXTRACTS, ReadsMap, bring_to_front, list_junctions, missing_for_build

NO_JUNCTION = "Click a junction first"


class SEIP_OT_import_network(ReadsMap, bpy.types.Operator):
    """Show all junctions of an extract of OpenStreetMap (.osm, .osm.gz, .osm.pbf) in a scene, from which the sites of single junctions are opened"""  # noqa: E501  # a tooltip is one line

    bl_idname = "seip.import_network"
    bl_label = "Import Whole Extract"

    filter_glob: bpy.props.StringProperty(default=EXTRACTS, options={"HIDDEN", "SKIP_SAVE"})

    def conclude(self, scene: bpy.types.Scene, result: SitePlaces) -> None:
        """Build the scene, and look at it from above."""
        if result.plan is None:
            raise SeipError(f"{self.filepath} is not an extract of OpenStreetMap: choose an .osm, .osm.gz or .osm.pbf")
        if not result.places:
            raise SeipError(f"{self.filepath} has no crossing of named streets: choose a larger extract")
        name = Path(self.filepath).name.partition(".")[0]
        if remove_startup_objects(scene) or not scene.objects:
            scene.name = name
        else:
            scene = bpy.data.scenes.new(name)
            sensor_types.list_types(scene)
        list_junctions(scene.seip.site, self.filepath, result)
        network.build_network(scene, [place.name for place in result.places], result.plan)
        _show(scene)
        self.report({"INFO"}, counted(len(result.places), "junction"))


class SEIP_OT_open_junction(Conditional, bpy.types.Operator):
    """Open the site of the selected junction in a scene of its own, and build it if it is not there yet"""

    bl_idname = "seip.open_junction"
    bl_label = "Open Site"

    @classmethod
    def why_not(cls, context: bpy.types.Context) -> str:
        """Return a reason if other work is running or no junction is selected."""
        if session.running is not None:
            return "Other work is under way"
        return NO_JUNCTION if selected_junction(context) is None else scene_status.not_own(context.scene)

    def execute(self, context: bpy.types.Context) -> Outcome:
        """Bring the scene of the site to the front."""
        return attempt(self, lambda: self._open(context))

    def _open(self, context: bpy.types.Context) -> None:
        whole, obj = context.scene, selected_junction(context)
        if obj is None:
            raise SeipError(NO_JUNCTION)
        scene = site_of(whole, obj)
        if scene is not None:
            bring_to_front(scene, lambda area: frame_site(area, scene))
            return
        whole.seip.site.junction = obj[contract.JUNCTION]
        missing = missing_for_build(whole)
        if missing:
            raise SeipError(missing)
        bpy.ops.seip.build_site("INVOKE_DEFAULT")


class SEIP_OT_show_network(Conditional, bpy.types.Operator):
    """Go back to the scene of the network, where junctions are coloured by the coverage of their sites"""

    bl_idname = "seip.show_network"
    bl_label = "Back to Network"

    @classmethod
    def why_not(cls, context: bpy.types.Context) -> str:
        """Return a reason if the site does not belong to a network."""
        return "This site is not of a network" if context.scene.seip.site.network is None else ""

    def execute(self, context: bpy.types.Context) -> Outcome:
        """Bring the scene of the network to the front."""
        _show(context.scene.seip.site.network)
        return {"FINISHED"}


def selected_junction(context: bpy.types.Context) -> bpy.types.Object | None:
    """Return the junction that is active and selected, if any."""
    obj = context.view_layer.objects.active
    return obj if obj is not None and contract.JUNCTION in obj and obj.select_get() else None


def site_of(whole: bpy.types.Scene, obj: bpy.types.Object) -> bpy.types.Scene | None:
    """Return the scene in which the site of a junction was built, if any."""
    place = whole.seip.site.place(obj[contract.JUNCTION])
    scenes = (one for one in bpy.data.scenes if one.seip.site.network == whole)
    return next((one for one in scenes if one.get(contract.BUILT) == place), None)


def _show(whole: bpy.types.Scene) -> None:
    """Bring the scene of a network to the front, its junctions coloured by what their sites have."""
    for obj in network.junctions(whole):
        network.paint_junction(obj, _colour(site_of(whole, obj)))
    bring_to_front(whole, lambda area: frame_plan(area, network.extent(whole)))


def _colour(scene: bpy.types.Scene | None) -> str:
    """Return the colour of a junction: grey without a site, otherwise that of the coverage."""
    if scene is None or scene_status.has_nothing(scene):
        return NO_SITE_COLOUR
    record = scene.seip.result.record
    return SHARE_COLOURS[coverage_level(parsed_record(record).coverage.whole if record else 0.0)]


CLASSES = (SEIP_OT_import_network, SEIP_OT_open_junction, SEIP_OT_show_network)
