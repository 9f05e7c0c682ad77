"""The section "Traffic and Detection": traffic, its simulation, scans, datasets, detection, verification."""

from __future__ import annotations

from pathlib import Path

import bpy

from .. import preferences
from ..core.base.errors import SeipError
from ..core.output.results.detection_record import MAIN_RULE, DetectionRecord, parsed_detection
from ..core.workflows.detection import ERRORS
from ..operators.detection import NO_PYTHON, sensors_key, why_no_detection
from ..operators.traffic import why_no_load, why_no_scan, why_no_simulation
from ..operators.verification import CHANGED as VERIFY_AGAIN
from ..operators.verification import NO_RECORDING, picture_of, sentences_of, why_no_correction, why_no_verification
from ..properties.conversion import absolute
from ..state.session import session
from . import sumo
from .sections import Status, draw_sections
from .sidebar import draw_path, draw_reason, draw_run, draw_runs, draw_settings
from .wrapped_text import BOX, draw_sentence

USED = "Detection and placements in traffic use these runs."
OTHER_SETTINGS = "The settings have changed since: simulate again."
NAMES = {
    MAIN_RULE: "AP of all",
    "car_van_0.7": "Cars, vans",
    "truck_bus_0.7": "Trucks, buses",
    "motorcycle_bicycle_0.5": "Two-wheelers",
    "pedestrian_0.5": "Pedestrians",
}
"""Names of road users by the rule that average precision is taken by."""
MEANING = (
    "AP, average precision, is 100% where every road user is found and nothing else is reported. A road user is found "
    "where its box and the detected one, seen from above, share 70% of the area that they cover together (50% for "
    "two-wheelers and pedestrians). In brackets the 95% interval over other traffic."
)
OTHER_SENSORS = "The sensors have changed since: detect again."


def _simulation_status(scene: bpy.types.Scene) -> Status:
    """Return whether the settings have changed since the last simulation."""
    simulation = scene.seip.simulation
    return Status(bool(simulation.facts) and simulation.made_with != simulation.key())


def draw_simulation(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw how traffic is simulated, and what was simulated last."""
    scene = context.scene
    simulation = scene.seip.simulation
    sumo.draw_missing(layout)
    draw_settings(layout, simulation, "flow", "pedestrians", "duration", "count")
    found = simulation.street_map()
    draw_path(layout, simulation, "map", placeholder="OpenDRIVE (.xodr)" if found is None else Path(found.name).name)
    draw_path(layout, simulation, "folder")
    reason = why_no_simulation(scene)
    draw_reason(layout, "" if preferences.sumo() is None else reason)  # without SUMO the sentence is there already
    draw_run(layout, "seip.simulate_traffic")
    if not simulation.facts:
        return
    draw_sentence(layout, f"{simulation.facts}. {USED}")
    if _simulation_status(scene).changed:
        draw_sentence(layout, OTHER_SETTINGS, icon="ERROR")


def _detection_status(scene: bpy.types.Scene) -> Status:
    """Return the average precision for the header, and whether the sensors have changed since."""
    detection = scene.seip.detection
    try:
        found = parsed_detection(detection.record) if detection.record else None
    except SeipError:
        found = None
    if found is None:
        return Status()
    return Status(sensors_key(scene) != detection.sensors, (f"AP {figures(found)[1][1].partition(' ')[0]}",))


def draw_detection(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw what is detected with what, and the last figures."""
    scene = context.scene
    detection = scene.seip.detection
    why_not = why_no_detection(scene)
    if draw_reason(layout, why_not):
        if why_not == NO_PYTHON:
            sumo.draw_preferences(layout)
    else:
        draw_runs(layout, scene)
        draw_path(layout, detection, "detector", placeholder="Shipped")
        draw_path(layout, detection, "folder")
        draw_run(layout, "seip.detect")
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
    if _detection_status(scene).changed:
        draw_sentence(column, OTHER_SENSORS, icon="ERROR", reserved=BOX)
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


def draw_verification(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the recording, the button, and what the last verification found."""
    scene = context.scene
    draw_path(layout, scene.seip.verification, "recording", "Recording (folder)", named=False)
    reason = why_no_verification(scene)
    draw_reason(layout, "" if reason == NO_RECORDING else reason)  # an empty field says so itself
    draw_run(layout, "seip.verify")
    sentences = sentences_of(scene)
    if not sentences:
        return
    box = layout.box()
    for sentence in sentences:
        draw_sentence(box, sentence, reserved=BOX)
    if changed := why_no_correction(scene):
        draw_sentence(box, changed, icon="INFO", reserved=BOX)
    row = box.row(align=True)
    row.operator("seip.correct_scene", icon="ADD")
    if (picture := picture_of(scene)) is not None:
        row.operator("wm.path_open", text="Show Picture", icon="IMAGE_DATA").filepath = str(picture)


def _each_status(scene: bpy.types.Scene) -> dict[str, Status]:
    """Return the status of each section that has one."""
    stale = bool(sentences_of(scene)) and why_no_correction(scene) == VERIFY_AGAIN
    return {
        "simulation": _simulation_status(scene),
        "detection": _detection_status(scene),
        "verification": Status(stale),
    }


def status(scene: bpy.types.Scene) -> Status:
    """Return whether some result below is out of date."""
    return Status(any(one.changed for one in _each_status(scene).values()))


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw where traffic comes from."""
    traffic = context.scene.seip.traffic
    column = layout.column(align=True)
    draw_path(column, traffic, "file", "Traffic (.npz, .xml)", named=False)
    files = traffic.files()
    if files is not None and not files.trajectories:
        draw_path(column, traffic, "routes", "Routes (vehicle types)", named=False)
        draw_path(column, traffic, "net", "Network (.net.xml)", named=False)
    draw_reason(layout, why_no_load(context.scene) if traffic.file else "")  # an empty field says so itself
    row = layout.row(align=True)
    draw_run(row, "seip.load_traffic")
    row.operator("seip.clear_traffic", text="", icon="TRASH")
    row.operator("screen.animation_play", text="", icon="PLAY")
    for line in traffic.loaded.splitlines():
        draw_sentence(layout, line)
    draw_sections(
        layout,
        {
            "simulation": draw_simulation,
            "scan": _draw_scan,
            "dataset": _draw_dataset,
            "detection": draw_detection,
            "verification": draw_verification,
        },
        context,
        _each_status(context.scene),
    )


def _draw_scan(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw how scans are made, and the last."""
    traffic = context.scene.seip.traffic
    if draw_reason(layout, why_no_scan(context.scene)):
        return
    draw_settings(layout, traffic, "noise", "seed", "rolling_shutter")
    draw_run(layout, "seip.scan_frame")
    scan = session.of(context.scene).scan
    for line in scan.facts if scan is not None else ():
        draw_sentence(layout, line)


def _draw_dataset(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw what is written where."""
    traffic = context.scene.seip.traffic
    if draw_reason(layout, why_no_scan(context.scene)):
        return
    draw_path(layout, traffic, "folder")
    part = () if traffic.whole else ("start", "duration")
    draw_settings(layout, traffic, "whole", *part, "rate", "split")
    layout.label(text="Formats")
    layout.column(align=True).prop(traffic, "formats")
    draw_run(layout, "seip.write_dataset")
