"""The section "Detection": average precision of a trained detector with the sensors in traffic."""

from __future__ import annotations

from pathlib import Path

import bpy

from .. import preferences
from ..core.errors import SeipError
from ..core.output.results.detection_record import MAIN_RULE, DetectionRecord, parsed_detection
from ..core.workflows.detection import ERRORS
from ..core.workflows.traffic_runs import traffic_folder
from ..operators.detection import NO_PYTHON, SEIP_OT_detect, sensors_key, why_no_detection
from ..properties.conversion import absolute
from .run_button import draw_run
from .sections import Status
from .sidebar import draw_path
from .wrapped_text import BOX, draw_sentence

NAMES = {
    MAIN_RULE: "AP of all",
    "car_van_0.7": "Cars, vans",
    "truck_bus_0.7": "Trucks, buses",
    "motorcycle_bicycle_0.5": "Two-wheelers",
    "pedestrian_0.5": "Pedestrians",
}
"""Of road users, by the rule that average precision is taken by."""
MEANING = (
    "AP, average precision, is 100% where every road user is found and nothing else is reported. A road user is found "
    "where its box and the detected one, seen from above, share 70% of the area that they cover together (50% for "
    "two-wheelers and pedestrians). In brackets the 95% interval over other traffic."
)
CHANGED = "The sensors have changed since: detect again."


def status(scene: bpy.types.Scene) -> Status:
    """Return the average precision for the header, and whether the sensors have changed since."""
    detection = scene.seip.detection
    try:
        found = parsed_detection(detection.record) if detection.record else None
    except SeipError:
        found = None
    if found is None:
        return Status()
    return Status(sensors_key(scene) != detection.sensors, (f"AP {figures(found)[1][1].partition(' ')[0]}",))


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw what is detected with what, and the last figures."""
    scene = context.scene
    detection = scene.seip.detection
    why_not = why_no_detection(scene)
    if why_not:
        draw_sentence(layout, why_not, icon="INFO")
        if why_not == NO_PYTHON and preferences.own() is not None:
            layout.operator("preferences.addon_show", text="Preferences").module = preferences.ADDON_ID
    else:
        draw_path(layout, detection, "runs", placeholder=traffic_folder(Path(bpy.data.filepath)).name)
        draw_path(layout, detection, "detector", placeholder="Shipped")
        draw_path(layout, detection, "folder")
        draw_run(layout, SEIP_OT_detect.bl_idname)
    if detection.record:
        _draw_found(layout, scene)


def _draw_found(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw the figures while they belong to the present sensors, and the folder of the files."""
    detection, box = scene.seip.detection, layout.box()
    try:
        found = parsed_detection(detection.record)
    except SeipError as error:
        draw_sentence(box, str(error), icon="ERROR", reserved=BOX)
        return
    column = box.column()
    if status(scene).changed:
        draw_sentence(column, CHANGED, icon="ERROR", reserved=BOX)
        column = box.column()
        column.active = False
    table = column.column(align=True)
    for name, figure in figures(found):
        row = table.split(factor=0.42)
        row.label(text=name)
        row.label(text=figure)
    draw_sentence(column, MEANING, reserved=BOX)
    for sentence in found.warnings:
        draw_sentence(column, sentence, icon="INFO", reserved=BOX)
    folder = absolute(detection.folder)
    if (folder / ERRORS).is_file():
        row = box.row(align=True)
        row.operator("wm.path_open", text="Picture of Errors", icon="IMAGE_DATA").filepath = str(folder / ERRORS)
        row.operator("wm.path_open", text="", icon="FILE_FOLDER").filepath = str(folder)


def figures(found: DetectionRecord) -> list[tuple[str, str]]:
    """Return how many road users there were, and the average precision of each kind with its interval, as text."""
    precisions = {NAMES[rule]: one for rule, one in found.average_precision.items() if rule in NAMES}
    lines = [(name, f"{one.average_precision:.1%}{_between(one.interval)}") for name, one in precisions.items()]
    return [("Road users", f"{precisions[NAMES[MAIN_RULE]].road_users:,}"), *lines]


def _between(interval: tuple[float, float] | None) -> str:
    return "" if interval is None else " ({:.1f}–{:.1f})".format(*(100.0 * end for end in interval))
