"""The operator that evaluates the sensors by what a trained detector finds with them in traffic."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy

from .. import preferences
from ..core.base.errors import SeipError
from ..core.base.progress import Progress
from ..core.output.results.detection_record import MAIN_RULE, parsed_detection
from ..core.storage.files import check_folder, digest, unfinished_name
from ..core.workflows.detection import INSTALL, DetectionJob, detect_elsewhere
from ..core.workflows.traffic_runs import found_runs
from ..properties.conversion import absolute, runs_folder, saved_path
from ..scene import contract
from ..scene.blend_file import save_blend
from ..scene.sensors import labelled_sensors, pose_of
from ..state import scene_status
from .base import Job, LongWork, started
from .traffic import no_sensors

NO_PYTHON = f"Detection needs a Python with PyTorch, named in the extension's preferences: {INSTALL}."


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
        request, python = scene.seip.detection, preferences.detecting_python()
        if python is None:
            raise SeipError(NO_PYTHON)
        job = DetectionJob(
            python,
            tuple(found_runs(runs_folder(scene.seip.traffic.runs))),
            absolute(request.detector) if request.detector else None,
            preferences.catalogue_files(),
            scene.seip.survey.weather(),
        )
        folder = saved_path(request.folder, "the figures")
        sensors = sensors_key(scene)
        scene, result = yield started(_detected(job, folder))
        scene.seip.detection.record, scene.seip.detection.sensors = result, sensors
        found = parsed_detection(result)
        for sentence in found.warnings:
            self.report({"WARNING"}, sentence)
        precision = found.average_precision[MAIN_RULE]
        self.report({"INFO"}, f"average precision {precision.average_precision:.1%}; written to {folder}")


def _detected(job: DetectionJob, folder: Path) -> Generator[Progress, None, str]:
    with saved_scene(folder) as scene:
        yield Progress(0, 0, "starting PyTorch")
        return (yield from detect_elsewhere(job, scene, folder))


@contextmanager
def saved_scene(folder: Path) -> Iterator[Path]:
    """Save the scene as it is in a folder of results, for another process, and remove it at the end."""
    with (
        folder_of_result(folder),
        TemporaryDirectory(prefix=unfinished_name(folder, "scene-").name, dir=folder) as temporary,
    ):
        path = Path(temporary) / "scene.blend"
        save_blend(path)
        yield path


@contextmanager
def folder_of_result(folder: Path) -> Iterator[None]:
    """Make a folder where it is missing, and take it away again where nothing was written to it."""
    new = [one for one in (folder, *folder.parents) if not one.exists()]
    check_folder(folder)
    try:
        yield
    finally:
        with suppress(OSError):  # it holds something
            for one in new:
                one.rmdir()
