"""Simulate what the sensors of a scene measure of its traffic: for each revolution a cloud per sensor, and the boxes.

blender -b --python-exit-code 1 placed.blend -P headless/simulate.py -- --traffic run-1.npz -o out/run-1
python -m headless.simulate placed.blend --traffic run-1.npz -o out/run-1

The merged cloud of a frame is the array ``points``; that of a sensor are those whose ``sensor`` is its number. A run
that was stopped goes on where it was when it is started again.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import session
from headless.survey import HelpWithDefaults

import bpy
import numpy as np

from seip_addon.core.datasets import FORMATS, SPLITS, SensorPose, TrafficRun, write_dataset
from seip_addon.core.errors import SeipError
from seip_addon.core.lidar import load_catalogue
from seip_addon.core.pictures.scan_view import save_scan_view
from seip_addon.core.progress import Progress, finish
from seip_addon.core.results.placement_record import versions
from seip_addon.core.scans import ScanSettings, frame_times, prepare, static_scene
from seip_addon.core.scans.run_folder import Record, Run, check_run_folder, load_frames, write_run
from seip_addon.core.scene_geometry import SceneGeometry
from seip_addon.core.traffic import Trajectories
from seip_addon.core.traffic.bodies import fitted_body
from seip_addon.core.visibility.ray_casting import engine_name
from seip_addon.scene.read import read_scene
from seip_addon.scene.sensors import read_sensors
from seip_addon.scene.traffic import read_traffic

FAR = 500.0
"""Metres from the region beyond which traffic is another place's."""


def main(argv: list[str]) -> None:
    """Simulate the frames of a run and write them to a folder."""
    options = _parser().parse_args(argv)
    session.check_folder(options.output)
    session.open_scene(options.scene)
    run = _run(options)
    check_run_folder(options.output, run)
    session.say(_in_words(run))
    with session.progress_bar() as report:
        simulation = finish(prepare(run.static, run.sensors, run.trajectories, run.bodies, run.settings), report)
    for sentence in simulation.warnings:
        session.say(f"warning: {sentence}")
    with session.progress_bar() as report:
        record = finish(write_run(options.output, run, simulation), report)
    session.say(_summary(record))
    save_scan_view(options.output / "frame.png", next(load_frames(options.output))[1], run.static.region, run.sensors)
    for key in options.format:
        with session.progress_bar() as report:
            _export(key, options, run, report)
    session.say(f"written to {options.output}/")


def _run(options: argparse.Namespace) -> Run:
    """Gather all that the frames follow from."""
    reading = read_scene(bpy.context.scene)
    for sentence in reading.warnings:
        session.say(f"warning: {sentence}")
    sensors = read_sensors(bpy.context.scene, load_catalogue(options.catalogue))
    trajectories = _trajectories(options.traffic, reading.geometry)
    return Run(
        static=static_scene(reading.geometry),
        origin=reading.geometry.origin,
        sensors=sensors,
        trajectories=trajectories,
        bodies=tuple(fitted_body(user) for user in trajectories.users),
        times=frame_times(trajectories, sensors, start=options.start, duration=options.duration, rate=options.rate),
        settings=ScanSettings(
            seed=options.seed,
            noise=not options.no_noise,
            rolling_shutter=options.rolling_shutter,
            engine=engine_name(options.engine),
        ),
        versions=versions(blender=bpy.app.version_string),
    )


def _trajectories(path: Path | None, geometry: SceneGeometry) -> Trajectories:
    """Return the traffic of a file, else that which is animated in the scene, in the scene's axes."""
    if path is None:
        with session.progress_bar() as report:
            return finish(read_traffic(bpy.context.scene), report)
    trajectories = Trajectories.load(path).moved_to(geometry.origin)
    left, bottom, right, top = geometry.region.bounds
    low, high = np.array([left, bottom]) - FAR, np.array([right, top]) + FAR
    plan = trajectories.position[:, :2]
    if not ((plan >= low) & (plan <= high)).all(axis=1).any():
        raise SeipError(f"all traffic of {path} is far from this scene: name traffic that was made for its map")
    return trajectories


def _export(key: str, options: argparse.Namespace, run: Run, report: Callable[[Progress], None]) -> None:
    """Write the run into the dataset of a format, beside the frames."""
    traffic = TrafficRun(
        name=options.output.resolve().name,
        split=options.split,
        key=run.key,
        sensors=tuple(SensorPose(s.label, s.model.name, s.xyz, s.orientation) for s in run.sensors),
        origin=run.origin,
        record=run.record(),
    )
    folder = options.output / key if options.dataset is None else options.dataset / key
    finish(write_dataset(FORMATS[key], load_frames(options.output), traffic, folder), report)
    session.say(f"{FORMATS[key].name}: {folder}/")


def _in_words(run: Run) -> str:
    lines = [
        f"{sensor.label}  {sensor.model.key} at ({', '.join(f'{value:.2f}' for value in sensor.xyz)})"
        for sensor in run.sensors
    ]
    lines.append(
        f"{len(run.times):,} frames from {run.times[0]:g} s to {run.times[-1]:g} s, "
        f"{len(run.trajectories):,} road users, {len(run.static.triangles):,} static triangles"
    )
    return "\n".join(lines)


def _summary(record: Record) -> str:
    frames = record["frames"]
    points, users = (sum(frame[what] for frame in frames) / len(frames) for what in ("points", "road_users"))
    empty = sum(frame["road_users"] == 0 for frame in frames)
    note = f"; {empty} frames have no road user" if empty else ""
    return f"{points:,.0f} points and {users:.1f} road users a frame{note}"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="simulate",
        description="Simulate what the sensors of a scene measure of its traffic.",
        formatter_class=HelpWithDefaults,
    )
    parser.add_argument("scene", nargs="?", type=Path, help="the .blend with its sensors; in Blender the open scene")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder of the run")
    parser.add_argument("--traffic", type=Path, metavar="NPZ", help="trajectories (those animated in the scene)")
    parser.add_argument("--catalogue", nargs="+", type=Path, default=[], metavar="TOML", help="catalogues of your own")
    when = parser.add_argument_group("frames")
    when.add_argument("--start", type=float, metavar="S", help="time of the first frame (the traffic's first)")
    when.add_argument("--duration", type=float, metavar="S", help="to the last frame (to the traffic's last)")
    when.add_argument("--rate", type=float, metavar="HZ", help="frames a second (the slowest sensor's turns)")
    how = parser.add_argument_group("measurement")
    how.add_argument("--seed", type=int, default=0, help="of noise and lost returns")
    how.add_argument("--rolling-shutter", action="store_true", help="traffic moves while a sensor turns")
    how.add_argument("--no-noise", action="store_true", help="exact ranges, and no return is lost")
    how.add_argument("--engine", choices=("auto", "bvh", "embree"), default="auto", help="ray caster")
    export = parser.add_argument_group("datasets")
    export.add_argument("--format", nargs="+", choices=tuple(FORMATS), default=[], help="also write the run in these")
    export.add_argument("--dataset", type=Path, metavar="DIR", help="folder of datasets (that of the run)")
    export.add_argument("--split", choices=SPLITS, default=SPLITS[0], help="of the dataset that the run belongs to")
    return parser


if __name__ == "__main__":
    session.run(main)
