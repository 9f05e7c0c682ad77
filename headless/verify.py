"""Compare an installed system with its plan, by a recording of its sensors.

seip verify out/placed.blend sweeps/ -o out/verified
blender -b --python-exit-code 1 -P headless/verify.py -- out/placed.blend sweeps/ -o out/verified
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import runtime
from headless.options import add_settings, add_weather, new_parser, read_settings
from headless.scanned_scene import read_scanned_scene

import bpy

from seip_addon.core.base.counts import counted
from seip_addon.core.base.errors import SeipError
from seip_addon.core.output.results.versions import versions
from seip_addon.core.sensing.recordings.comparison import VEHICLE
from seip_addon.core.sensing.recordings.recording import open_recording
from seip_addon.core.sensing.recordings.verification import Verification
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.workflows.survey_settings import SurveySettings
from seip_addon.core.workflows.verification_record import UNITS_FILE, write_verification
from seip_addon.core.workflows.verifying import verify
from seip_addon.scene.blend_file import save_blend
from seip_addon.scene.corrections import correct_scene

_LEAST_COST = 0.0005  # share of coverage that is shown as 0.1 points


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
    for line in _lines(found):
        runtime.print_line(line)
    written = "verified.blend, changes.png, changes.csv, verification.json"
    runtime.print_line(f"written to {folder}/: {written}{f', {UNITS_FILE}' * (folder / UNITS_FILE).exists()}")


def _lines(found: Verification) -> list[str]:
    lines = []
    for one in found.sensors:
        gain = one.gain
        errors = zip(one.shift_m, one.shift_half_width_m, strict=True)
        east, north, up = (f"{value:+.3f} ± {math.ceil(1000 * half) / 1000:.3f}" for value, half in errors)
        received = "" if gain is None else f"; gain {gain.value:.2f} ({gain.low:.2f} to {gain.high:.2f})"
        lines.append(
            f"{one.id}: {math.hypot(*one.shift_m):.2f} m and {math.hypot(*one.rotation_deg):.1f}° from its plan "
            f"(x {east}, y {north}, z {up} m){received}"
        )
    for change, cost in zip(found.changes, found.costs, strict=True):
        if change.kind == VEHICLE:
            continue
        x, y, _, length, width, height, _ = change.box.tolist()
        verb = "is new" if change.kind == "new" else "is no longer there"
        costs = "" if math.isnan(cost) else f", {_cost(cost)}"
        lines.append(f"{change.name} {verb}: {length:.1f} × {width:.1f} × {height:.1f} m at ({x:.1f}, {y:.1f}){costs}")
    standing = sum(change.kind == VEHICLE for change in found.changes)
    if standing:
        lines.append(f"{counted(standing, 'vehicle')} standing on the carriageway: not counted as objects")
    steps = found.coverage
    lines.append(
        f"coverage: {steps.promised:.1%} promised, {steps.installed:.1%} installed; in percentage points: "
        f"pose {100 * (steps.pose - steps.promised):+.1f}, obstacles {100 * (steps.obstacles - steps.pose):+.1f}, "
        f"gain {100 * (steps.installed - steps.obstacles):+.1f}"
    )
    returned = f"{steps.returned:.1%} of the targets have a return nearby in nearly every sweep"
    lines.append(f"{returned}, for which one bright spot is enough")
    return lines


def _cost(cost: float) -> str:
    points = f"{abs(100 * cost):.1f} points of coverage"
    return "no effect on coverage" if abs(cost) < _LEAST_COST else f"{'costs' if cost > 0 else 'adds'} {points}"


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("verify", "Compare installed sensors with their plan, by a recording.")
    parser.add_argument("scene", type=Path, help="the .blend of the plan, with its sensors")
    parser.add_argument("recording", type=Path, help="folder of sweeps, or of a folder for each sensor")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the results")
    add_settings(parser, SurveySettings, "catalogue", "grid_spacing")
    add_weather(parser)
    return parser


if __name__ == "__main__":
    runtime.run(main)
