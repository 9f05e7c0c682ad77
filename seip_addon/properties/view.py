"""Properties of the view: how results are shown."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

from .. import last_scan
from ..viewport import coverage


def _recolour(_own: object, context: bpy.types.Context) -> None:
    last_scan.show_cloud(context.scene)


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
            ("sensor", "Sensor", "Which sensor measured the point"),
            ("intensity", "Intensity", "How strong the return is"),
            ("instance", "Road User", "Which road user returned it"),
        ),
        update=_recolour,
    )
    picture: StringProperty(
        name="Picture",
        description="PNG to write; where one of that name is there already, the next gets a number",
        subtype="FILE_PATH",
        default="//placement.png",
        options={"OUTPUT_PATH", "PATH_SUPPORTS_BLEND_RELATIVE"},
    )


CLASSES = (SEIP_PG_view,)
