"""Properties of the results: placements, and what is looked at of them."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, CollectionProperty, IntProperty, StringProperty

from .. import selection


class SEIP_PG_chosen(bpy.types.PropertyGroup):
    """A sensor of the placement; its name is its label."""


class SEIP_PG_placement(bpy.types.PropertyGroup):
    """A placement: enough to find all about it again from the scene and the visibility kept in the cache."""

    record: StringProperty(name="Record", description="Placement as in placement.json")
    targets: StringProperty(name="Targets", description="Digest of the placement's targets")
    seen: StringProperty(name="Seen", description="Number of sensors that see each target, packed")


class SEIP_PG_result(SEIP_PG_placement):
    """The placement that stands in the scene, and what is looked at of it."""

    change: StringProperty(name="Change", description="Difference from the placement before")
    sensors: CollectionProperty(type=SEIP_PG_chosen)
    active_sensor: IntProperty(
        name="Sensor",
        description="Click to select the sensor in the scene",
        update=selection.select_sensor,
    )
    folder: StringProperty(
        name="Folder",
        description="Folder for the result; // is the folder of the .blend",
        subtype="DIR_PATH",
        default="//seip-result/",
        options={"OUTPUT_PATH", "PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    render: BoolProperty(
        name="Include Rendered View",
        description="Add a rendered view of the scene to the files and the report, which takes a minute",
        default=False,
    )


CLASSES = (SEIP_PG_chosen, SEIP_PG_placement, SEIP_PG_result)
