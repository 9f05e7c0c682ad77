"""Verification: installed sensors compared with their plan by a recording."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
from bpy.props import StringProperty

from ..core.base.errors import SeipError
from ..core.base.progress import Progress
from ..core.output.results.file_names import VERIFICATION_FOLDER, VERIFICATION_PICTURE
from ..core.output.results.verification_record import summary
from ..core.output.results.versions import versions
from ..core.sensing.recordings.recording import Recording, open_recording
from ..core.sensing.recordings.verification import Verification
from ..core.sensing.scans.sensor import MountedSensor
from ..core.site.scene_geometry import SceneGeometry
from ..core.storage.files import check_folder, whole_file
from ..core.workflows.survey_settings import SurveySettings
from ..core.workflows.verification_record import record_of, write_verification
from ..core.workflows.verifying import verify
from ..scene.changes import watch
from ..scene.corrections import correct_scene
from ..scene.read import read_scene
from ..scene.sensors import read_sensors
from . import following, preferences, scene_status
from .detection import folder_of_result
from .layout import BOX, Status, draw_path, draw_reason, draw_run, draw_sentence
from .properties import absolute, path_property, saved_path
from .scene_status import no_folder, no_sensors
from .session import session
from .work import Job, LongWork, ShortWork

NO_RECORDING = "Name a recording of the installed sensors: a folder of sweeps."
NOT_VERIFIED = "Not verified since the file was opened: verify again to add the changes."
CHANGED = "The scene has changed since: verify again."
CHANGES = VERIFICATION_PICTURE


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


def why_no_verification(scene: bpy.types.Scene) -> str:
    """Return why the installation cannot be verified, or ""."""
    reason = scene_status.obstacle(scene) or no_sensors(scene) or no_folder(scene)
    return reason or ("" if scene.seip.verification.recording else NO_RECORDING)


def why_no_correction(scene: bpy.types.Scene) -> str:
    """Return why the scene cannot be corrected by the last verification, or ""."""
    last = session.of(scene).verification
    if last is None:
        return NOT_VERIFIED
    return CHANGED if last[1].changed else ""


def sentences_of(scene: bpy.types.Scene) -> tuple[str, ...]:
    """Return what the last verification of a scene found; the file keeps it."""
    return tuple(scene.seip.verification.found.splitlines())


def picture_of(scene: bpy.types.Scene) -> Path | None:
    """Return the picture of a scene's last verification, None where it is gone."""
    path = None if no_folder(scene) else _folder_of(scene) / CHANGES
    return path if path is not None and path.is_file() else None


def _folder_of(scene: bpy.types.Scene) -> Path:
    return saved_path(scene.seip.result.folder, "the verification") / VERIFICATION_FOLDER


class SEIP_OT_verify(LongWork, bpy.types.Operator):
    """Compare the installed sensors with the plan by a recording: poses, changes and coverage"""

    bl_label = "Verify Installation"
    bl_options = {"REGISTER", "UNDO"}  # the scene keeps what was found, also when a correction is undone
    stopped_message = "stopped; nothing was written"

    obstacles = (why_no_verification,)

    def job(self, scene: bpy.types.Scene) -> Job:
        """Compare the scene and its sensors with the recording, write the files, and keep what was found."""
        settings = scene.seip.survey.settings()
        folder, watching = _folder_of(scene), watch(scene)
        geometry = settings.weather.over(read_scene(scene).geometry)
        sensors = tuple(
            replace(one, model=settings.weather.through(one.model))
            for one in read_sensors(scene, preferences.catalogue())
        )
        recording = open_recording(
            absolute(scene.seip.verification.recording), min(one.model.rotation_rate for one in sensors)
        )
        scene, (found, files) = yield _verified(folder, geometry, sensors, recording, settings)
        check_folder(folder)
        for name, content in files.items():
            with whole_file(folder / name) as temporary:
                temporary.write_bytes(content)
        scene.seip.verification.found = "\n".join(summary(record_of(scene.name, "", found)))
        session.of(scene).verification = (found, watching)
        self.warn(found.warnings)
        self.report({"INFO"}, f"verified; written to {folder}")


def _verified(
    folder: Path,
    geometry: SceneGeometry,
    sensors: tuple[MountedSensor, ...],
    recording: Recording,
    settings: SurveySettings,
) -> Generator[Progress, None, tuple[Verification, Mapping[str, bytes]]]:
    """Return the verification with the content of its files."""
    with folder_of_result(folder), TemporaryDirectory(prefix="seip-") as raw:
        found = yield from verify(
            geometry, sensors, recording, settings.visibility, spacing=settings.grid_spacing, engine=settings.engine
        )
        yield Progress(0, 0, "drawing the differences")
        made_with = versions(blender=bpy.app.version_string)
        write_verification(Path(raw), geometry, sensors, recording.name, found, made_with)
        return found, {path.name: path.read_bytes() for path in sorted(Path(raw).iterdir())}


class SEIP_OT_correct_scene(ShortWork, bpy.types.Operator):
    """Add new objects as boxes, remove those that are gone, and move the sensors to their installed poses"""

    bl_label = "Add to Scene"
    bl_options = {"REGISTER", "UNDO"}

    obstacles = (why_no_correction,)

    def act(self, context: bpy.types.Context) -> None:
        """Correct the scene."""
        scene = context.scene
        last = session.of(scene).verification
        if last is None:
            raise SeipError(NOT_VERIFIED)
        following.stop()
        found, changes = last
        problems = correct_scene(scene, found)
        changes.look(scene)  # so that nothing is added twice
        self.warn(problems)
        self.report({"INFO"}, "the scene is as recorded; its placement is stale")


def status(scene: bpy.types.Scene) -> Status:
    """Return whether the scene has changed since it was verified."""
    return Status(bool(sentences_of(scene)) and why_no_correction(scene) == CHANGED)


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
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
