"""Properties of detection: with what it is done, and what was found."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty


class SEIP_PG_detection(bpy.types.PropertyGroup):
    """Settings of detection, and the latest figures."""

    runs: StringProperty(
        name="Runs",
        description="Folder with runs of traffic (.npz) to detect road users in, four or more for an interval. "
        "Empty for the folder SCENE_traffic beside the file",
        subtype="DIR_PATH",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    detector: StringProperty(
        name="Detector",
        description="A trained detector (.pt) of your own; empty for the one that comes with the project",
        subtype="FILE_PATH",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    folder: StringProperty(
        name="Folder",
        description="Folder for figures, charts and detections; // is the folder of the .blend",
        subtype="DIR_PATH",
        default="//seip-detection/",
        options={"OUTPUT_PATH", "PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    record: StringProperty(name="Record", description="Figures as in detection.json")
    sensors: StringProperty(name="Sensors", description="Digest of the sensors of the figures")


CLASSES = (SEIP_PG_detection,)
