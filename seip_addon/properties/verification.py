"""Properties of the verification of an installation."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty


class SEIP_PG_verification(bpy.types.PropertyGroup):
    """Recording of the installed sensors."""

    recording: StringProperty(
        name="Recording",
        description="Folder with a folder of sweeps for each sensor, named after it, or a .pcap of an Ouster sensor. "
        "To choose a folder, open it and press Accept with no file chosen",
        subtype="FILE_PATH",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    found: StringProperty(
        name="Found", description="Results of the last verification, one sentence a line", options={"HIDDEN"}
    )


CLASSES = (SEIP_PG_verification,)
