"""Properties of a scene: results, detection, verification, views, and all others by feature."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, IntProperty, PointerProperty, StringProperty

from ..core.base.errors import SeipError
from ..core.output.results.placement_record import parsed_record
from ..scene import contract
from ..state import selection
from ..state.scene_status import FILE_VERSION
from ..viewport import coverage, last_scan
from .conversion import path_property
from .placement import SEIP_PG_goal
from .site import SEIP_PG_site
from .survey import SEIP_PG_survey
from .traffic import SEIP_PG_simulation, SEIP_PG_traffic


class SEIP_PG_chosen(bpy.types.PropertyGroup):
    """A sensor of the placement; its name is its label."""


class SEIP_PG_placement(bpy.types.PropertyGroup):
    """Stored placement; the rest is recomputed from the scene and the cached visibility."""

    record: StringProperty(name="Record", description="Placement as in placement.json")
    targets: StringProperty(name="Targets", description="Digest of the placement's targets")
    seen: StringProperty(name="Seen", description="Number of sensors that see each target, packed")


class SEIP_PG_result(SEIP_PG_placement):
    """Current placement and its display settings."""

    change: StringProperty(name="Change", description="Difference from the placement before")
    sensors: CollectionProperty(type=SEIP_PG_chosen)
    active_sensor: IntProperty(
        name="Sensor",
        description="Click to select the sensor in the scene",
        update=selection.select_sensor,
    )
    folder: path_property(
        "Folder", "Folder for the result; // is the folder of the .blend", folder=True, default="//seip-result/"
    )
    render: BoolProperty(
        name="Include Rendered View",
        description="Add a rendered view of the scene to the files and the report, which takes a minute",
        default=False,
    )

    def active_label(self) -> str:
        """Return the label of the sensor that is active in the list, or ""."""
        number = self.active_sensor
        return self.sensors[number].name if number in range(len(self.sensors)) else ""

    def keep(self, record: str, targets: str, seen: str) -> None:
        """Keep a placement as the current one, with a row for each of its sensors."""
        self.record, self.targets, self.seen = record, targets, seen
        self.sensors.clear()
        for sensor in parsed_record(record).sensors:
            self.sensors.add().name = sensor.id


class SEIP_PG_detection(bpy.types.PropertyGroup):
    """Settings of detection, and the latest figures."""

    detector: path_property(
        "Detector", "A trained detector (.pt) of your own; empty for the one that comes with the project"
    )
    folder: path_property(
        "Folder",
        "Folder for figures, charts and detections; // is the folder of the .blend",
        folder=True,
        default="//seip-detection/",
    )
    record: StringProperty(name="Record", description="Figures as in detection.json")
    sensors: StringProperty(name="Sensors", description="Digest of the sensors of the figures")


class SEIP_PG_verification(bpy.types.PropertyGroup):
    """Recording of the installed sensors."""

    recording: path_property(
        "Recording",
        "Folder with a folder of sweeps for each sensor, named after it. "
        "To choose a folder, open it and press Accept with no file chosen",
    )
    found: StringProperty(
        name="Found", description="Results of the last verification, one sentence a line", options={"HIDDEN"}
    )


def _recolour(own: bpy.types.PropertyGroup, _context: object) -> None:
    last_scan.show_cloud(own.id_data)


def _show_legend(own: bpy.types.PropertyGroup, _context: object) -> None:
    coverage.update(own.id_data)


class SEIP_PG_view(bpy.types.PropertyGroup):
    """Display settings of the results."""

    legend: BoolProperty(
        name="Legend",
        description="Show the legend of the coverage colours, and the sensors' labels",
        default=True,
        update=_show_legend,
    )
    cloud_colour: EnumProperty(
        name="Point Colours",
        description="Meaning of the point cloud's colours",
        items=(
            ("sensor", "Sensor", "Sensor that measured the point"),
            ("intensity", "Intensity", "Intensity of the return"),
            ("instance", "Road User", "Road user that the point is on"),
        ),
        update=_recolour,
    )
    picture: path_property(
        "Picture",
        "PNG to write; where one of that name is there already, the next gets a number",
        default="//placement.png",
    )


class SEIP_PG_scene(bpy.types.PropertyGroup):
    """All that SEIP keeps with a scene."""

    version: IntProperty(name="Version", default=FILE_VERSION, options={"HIDDEN"})
    site: PointerProperty(type=SEIP_PG_site)
    survey: PointerProperty(type=SEIP_PG_survey)
    goal: PointerProperty(type=SEIP_PG_goal)
    result: PointerProperty(type=SEIP_PG_result)
    kept: CollectionProperty(type=SEIP_PG_placement)
    active_kept: IntProperty(name="Kept Placement", description="Placement to compare the present one with")
    view: PointerProperty(type=SEIP_PG_view)
    traffic: PointerProperty(type=SEIP_PG_traffic)
    simulation: PointerProperty(type=SEIP_PG_simulation)
    detection: PointerProperty(type=SEIP_PG_detection)
    verification: PointerProperty(type=SEIP_PG_verification)

    def take_over_placement(self) -> None:
        """Take over the placement that a command has stored in the scene, and its settings, if there is one."""
        scene = self.id_data
        stored = scene.get(contract.PLACEMENT)
        if stored is None:
            return
        try:
            request = parsed_record(stored["record"]).request
        except SeipError:  # of a newer version: the sensors can still be evaluated
            return
        self.result.keep(*(stored[name] for name in ("record", "targets", "seen")))
        self.survey.take_over(request)
        self.goal.take_over(request.goal)
        del scene[contract.PLACEMENT]


PROPERTIES = ((bpy.types.Scene, "seip", PointerProperty(type=SEIP_PG_scene)),)
