"""Detection: evaluation of the sensors by what a trained detector finds with them in traffic."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
from bpy.props import StringProperty

from ..core.base.errors import SeipError
from ..core.base.progress import Progress
from ..core.output.results.detection_record import MAIN_RULE, DetectionRecord, parsed_detection
from ..core.storage.files import check_folder, digest, unfinished_name
from ..core.workflows.detection import ERRORS, INSTALL, DetectionJob, detect_elsewhere
from ..core.workflows.traffic_runs import found_runs
from ..scene import contract
from ..scene.blend_file import save_blend
from ..scene.sensors import labelled_sensors, pose_of
from . import preferences, scene_status
from .layout import BOX, Status, draw_path, draw_reason, draw_run, draw_runs, draw_sentence
from .properties import absolute, complaint, path_property, runs_folder, saved_path
from .scene_status import no_sensors
from .work import Job, LongWork, started

NO_PYTHON = f"Detection needs a Python with PyTorch, named in the extension's preferences: {INSTALL}."
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


def why_no_detection(scene: bpy.types.Scene) -> str:
    """Return why nothing can be detected; nothing where it can."""
    return no_sensors(scene) or scene_status.obstacle(scene) or no_python(scene)


def no_python(_scene: bpy.types.Scene) -> str:
    """Return that there is no Python for detection, or ""."""
    return "" if preferences.detecting_python() is not None else NO_PYTHON


def sensors_key(scene: bpy.types.Scene) -> str:
    """Return a digest of the types and poses of a scene's sensors; empty where one has no proper transform."""
    try:
        each = [(label, str(obj.get(contract.SENSOR)), *pose_of(obj)) for label, obj in labelled_sensors(scene).items()]
    except SeipError:
        return ""
    return digest(*(part for parts in each for part in parts))


class SEIP_OT_detect(LongWork, bpy.types.Operator):
    """Scan runs of traffic with the sensors of the scene and detect road users; runs in a separate Python with PyTorch"""  # noqa: E501  # a tooltip is one line

    stopped_message = "stopped; nothing was written"

    obstacles = (why_no_detection,)

    def job(self, scene: bpy.types.Scene) -> Job:
        """Save the scene as it is for the process that detects, and keep the figures with the scene."""
        request = scene.seip.detection
        job = detection_job(scene, absolute(request.detector) if request.detector else None)
        folder = saved_path(request.folder, "the figures")
        sensors = sensors_key(scene)
        scene, result = yield started(_detected(job, folder))
        scene.seip.detection.record, scene.seip.detection.sensors = result, sensors
        found = parsed_detection(result)
        self.warn(found.warnings)
        precision = found.average_precision[MAIN_RULE]
        self.report({"INFO"}, f"average precision {precision.average_precision:.1%}; written to {folder}")


def detection_job(scene: bpy.types.Scene, detector: Path | None) -> DetectionJob:
    """Return the job of detecting in the scene's runs of traffic, or raise a `SeipError` where something is missing."""
    python = preferences.detecting_python()
    if python is None:
        raise SeipError(NO_PYTHON)
    runs = tuple(found_runs(runs_folder(scene.seip.traffic.runs)))
    return DetectionJob(python, runs, detector, preferences.catalogue_files(), scene.seip.survey.weather())


def _detected(job: DetectionJob, folder: Path) -> Generator[Progress, None, str]:
    with saved_scene(folder) as scene:
        yield Progress(0, 0, "starting PyTorch")
        return (yield from detect_elsewhere(job, scene, folder))


@contextmanager
def saved_scene(folder: Path) -> Iterator[Path]:
    """Save the scene as it is in a folder of results, for another process, and remove it at the end.

    The folder is made where it is missing, and taken away again where nothing was written to it.
    """
    new = [one for one in (folder, *folder.parents) if not one.exists()]
    check_folder(folder)
    try:
        with TemporaryDirectory(prefix=unfinished_name(folder, "scene-").name, dir=folder) as temporary:
            path = Path(temporary) / "scene.blend"
            save_blend(path)
            yield path
    finally:
        with suppress(OSError):  # it holds something
            for one in new:
                one.rmdir()


def status(scene: bpy.types.Scene) -> Status:
    """Return the average precision for the header, and whether the sensors have changed since."""
    detection = scene.seip.detection
    if not detection.record or complaint(lambda: parsed_detection(detection.record)):
        return Status()
    found = parsed_detection(detection.record)
    return Status(sensors_key(scene) != detection.sensors, (f"AP {figures(found)[1][1].partition(' ')[0]}",))


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw what is detected with what, and the last figures."""
    scene = context.scene
    detection = scene.seip.detection
    why_not = why_no_detection(scene)
    if draw_reason(layout, why_not):
        if why_not == NO_PYTHON:
            preferences.draw_preferences(layout)
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
    if wrong := complaint(lambda: parsed_detection(detection.record)):
        draw_sentence(box, wrong, icon="ERROR", reserved=BOX)
        return
    found = parsed_detection(detection.record)
    column = box.column()
    if status(scene).changed:
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
