"""Simulate the scans that a scene's sensors make of its traffic, and write datasets.

blender -b --python-exit-code 1 placed.blend -P headless/simulate.py -- --traffic run-1.npz -o out/run-1
seip simulate placed.blend --traffic run-1.npz -o out/run-1

The merged cloud of a frame is the array ``points``; that of a sensor are those whose ``sensor`` is its number. A run
that was stopped goes on where it was when it is started again.
"""

import argparse
import sys
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import runtime
from headless.options import add_settings, add_weather, new_parser, read_settings
from headless.scanned_scene import read_scanned_scene

import bpy

from seip_addon.core.base.counts import counted
from seip_addon.core.output.datasets.formats import FORMATS
from seip_addon.core.output.datasets.sample import SPLITS
from seip_addon.core.output.results.versions import versions
from seip_addon.core.sensing.scans.run_folder import Record, Run, check_run_folder
from seip_addon.core.sensing.scans.simulation import ScanSettings
from seip_addon.core.sensing.traffic.site_traffic import load_trajectories
from seip_addon.core.storage.folder_contents import check_no_placement
from seip_addon.core.workflows.recording import RecordingSettings, dataset_folder, make_run, record, simulation_of
from seip_addon.core.workflows.survey_settings import SurveySettings
from seip_addon.scene.sensors import changed_beams
from seip_addon.scene.traffic import read_traffic


def main(argv: list[str]) -> None:
    """Simulate the frames of a run and write them to a folder."""
    options = _parser().parse_args(argv)
    check_no_placement(options.output)
    runtime.check_folder(options.output)
    if options.dataset is not None:
        runtime.check_folder(options.dataset)
    runtime.open_scene(options.scene)
    settings = _settings(options)
    run = _run(options, settings)
    check_run_folder(options.output, run)
    runtime.LOG.info(_describe(run))
    simulation = runtime.finish_with_bar(simulation_of(run))
    runtime.warn(simulation.warnings)
    manifest = runtime.finish_with_bar(record(options.output, run, simulation, settings))
    runtime.print_line(_summary(manifest))
    for key in settings.formats:
        runtime.print_line(f"{FORMATS[key].name}: {dataset_folder(options.output, settings, key)}/")
    runtime.print_line(f"written to {options.output}/")


def _settings(options: argparse.Namespace) -> RecordingSettings:
    scan = read_settings(ScanSettings, options, weather=tuple(options.weather))
    return read_settings(RecordingSettings, options, scan=scan, formats=tuple(options.format), split=options.split)


def _run(options: argparse.Namespace, settings: RecordingSettings) -> Run:
    """Read what the frames follow from: the scene, its sensors, and its traffic."""
    reading, sensors = read_scanned_scene(options)
    runtime.warn(reading.warnings)
    runtime.warn(changed_beams(bpy.context.scene, sensors))
    if options.traffic is None:
        trajectories = runtime.finish_with_bar(read_traffic(bpy.context.scene))
    else:
        trajectories = load_trajectories(options.traffic, reading.geometry)
    return make_run(reading.geometry, sensors, trajectories, settings, versions(blender=bpy.app.version_string))


def _describe(run: Run) -> str:
    lines = [
        f"{sensor.label}  {sensor.model.key} at ({', '.join(f'{value:.2f}' for value in sensor.xyz)})"
        for sensor in run.sensors
    ]
    lines.append(
        f"{counted(len(run.times), 'frame')} from {run.times[0]:g} s to {run.times[-1]:g} s, "
        f"{counted(len(run.trajectories), 'road user')}, {counted(len(run.static.triangles), 'static triangle')}"
    )
    return "\n".join(lines)


def _summary(manifest: Record) -> str:
    frames = manifest["frames"]
    points, users = (sum(frame[what] for frame in frames) / len(frames) for what in ("points", "road_users"))
    empty = sum(frame["road_users"] == 0 for frame in frames)
    note = f"; {counted(empty, 'frame has', 'frames have')} no road user" if empty else ""
    return f"{points:,.0f} points and {users:.1f} road users a frame{note}"


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("seip simulate", "Simulate what the sensors of a scene measure of its traffic.")
    parser.add_argument("scene", nargs="?", type=Path, help="the .blend with its sensors; in Blender the open scene")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder of the run")
    parser.add_argument(
        "--traffic", type=Path, metavar="NPZ", help="trajectories (default: animated objects of the scene)"
    )
    add_settings(parser, SurveySettings, "catalogue")
    when = parser.add_argument_group("frames")
    add_settings(when, RecordingSettings, "start", "duration", "rate")
    how = parser.add_argument_group("measurement")
    add_settings(how, ScanSettings, "seed", "rolling_shutter")
    add_weather(how)
    export = parser.add_argument_group("datasets")
    export.add_argument(
        "--format", nargs="+", choices=tuple(FORMATS), default=[], help="also write the run in these formats"
    )
    add_settings(export, RecordingSettings, "dataset")
    export.add_argument("--split", choices=SPLITS, default=SPLITS[0], help="split of the dataset for the run")
    return parser


if __name__ == "__main__":
    runtime.run(main)
