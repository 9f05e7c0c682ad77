"""Compare an installed system with its plan, by a recording of its sensors.

seip verify out/placed.blend sweeps/ -o out/verified
blender -b --python-exit-code 1 -P headless/verify.py -- out/placed.blend sweeps/ -o out/verified
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import runtime
from headless.options import add_settings, add_weather, new_parser, read_settings
from headless.scanned_scene import read_scanned_scene

import bpy

from seip_addon.core.base.counts import counted
from seip_addon.core.base.errors import SeipError
from seip_addon.core.output.results.verification_record import (
    VerificationRecord,
    change_text,
    cost_text,
    coverage_text,
    gain_text,
    objects,
    pose_text,
    vehicles,
)
from seip_addon.core.output.results.versions import versions
from seip_addon.core.sensing.recordings.recording import open_recording
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.workflows.survey_settings import SurveySettings
from seip_addon.core.workflows.verification_record import UNITS_FILE, record_of, write_verification
from seip_addon.core.workflows.verifying import verify
from seip_addon.scene.blend_file import save_blend
from seip_addon.scene.corrections import correct_scene


def main(argv: list[str]) -> None:
    """Compare a recording with a scene, and write what differs."""
    options = _parser().parse_args(argv)
    if options.scene.suffix.lower() != ".blend":
        raise SeipError(f"{options.scene} is not a .blend: name the scene of the plan first, then the recording")
    runtime.check_folder(options.output)
    runtime.open_scene(options.scene)
    reading, planned = read_scanned_scene(options)
    geometry = reading.geometry
    recording = open_recording(options.recording, min(one.model.rotation_rate for one in planned))
    spacing = read_settings(SurveySettings, options).grid_spacing
    found = runtime.finish_with_bar(verify(geometry, planned, recording, VisibilitySettings(), spacing=spacing))
    folder = options.output
    runtime.warn(found.warnings)
    with runtime.incomplete_if_interrupted(folder):
        made_with = versions(blender=bpy.app.version_string)
        write_verification(folder, geometry, planned, recording.name, found, made_with)
        runtime.warn(correct_scene(bpy.context.scene, found))
        save_blend(folder / "verified.blend")
    for line in _lines(record_of(geometry.name, recording.name, found)):
        runtime.print_line(line)
    written = "verified.blend, changes.png, changes.csv, verification.json"
    runtime.print_line(f"written to {folder}/: {written}{f', {UNITS_FILE}' * (folder / UNITS_FILE).exists()}")


def _lines(record: VerificationRecord) -> Iterator[str]:
    """Yield how far each sensor is from its plan, what has changed, and the coverage."""
    for one in record.sensors:
        yield f"{pose_text(one)} {gain_text(one)}"
    for change in objects(record):
        yield f"{change.name}: {change_text(change)}, {cost_text(change.coverage_cost)}"
    if standing := vehicles(record):
        yield f"{counted(standing, 'vehicle')} standing on the carriageway: not counted as objects"
    yield coverage_text(record.coverage)


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("seip verify", "Compare installed sensors with their plan, by a recording.")
    parser.add_argument("scene", type=Path, help="the .blend of the plan, with its sensors")
    parser.add_argument("recording", type=Path, help="folder of sweeps, or of a folder for each sensor")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the results")
    add_settings(parser, SurveySettings, "catalogue", "grid_spacing")
    add_weather(parser)
    return parser


if __name__ == "__main__":
    runtime.run(main)
