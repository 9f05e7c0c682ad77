"""Add traffic to a scene: SUMO's floating car data, or a SUMO simulation on the scene's map.

In Blender, on the scene that is open::

    blender -b --python-exit-code 1 site.blend -P headless/traffic.py -- --fcd run.fcd.xml --routes run.rou.xml -o t.npz

or as plain Python on the bpy module::

    seip traffic site.blend --simulate site.net.xml --flow 600 --seed 1 --duration 120 -o traffic.npz
"""

import argparse
import sys
from contextlib import ExitStack
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import runtime
from headless.options import add_settings, new_parser, read_settings, refuse_idle

import bpy

from seip_addon.core.base.counts import counted
from seip_addon.core.sensing.traffic.floating_car_data import listed
from seip_addon.core.sensing.traffic.source import TrafficFiles, describe_categories, load_traffic
from seip_addon.core.sensing.traffic.trajectories import Trajectories
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.storage.files import locked
from seip_addon.core.workflows.traffic_simulation import SimulationSettings
from seip_addon.core.world.traffic_simulation.demand import Demand
from seip_addon.scene.blend_file import check_name, save_blend
from seip_addon.scene.read import read_scene
from seip_addon.scene.traffic import animate

_READING = ("routes", "net", "start")
_SIMULATING = ("flow", "pedestrians", "seed", "warm_up")


def main(argv: list[str]) -> None:
    """Read or simulate traffic, fit it to the road and write it."""
    parser = _parser()
    options = parser.parse_args(argv)
    simulated = options.fcd is None
    refuse_idle(parser, options, _READING if simulated else _SIMULATING, "--fcd" if simulated else "--simulate")
    if options.animate is not None:
        check_name(options.animate)
    with ExitStack() as locks:
        for path in filter(None, (options.output, options.animate)):
            locks.enter_context(locked(path, folder=False))
        _make(options)


def _make(options: argparse.Namespace) -> None:
    runtime.open_scene(options.scene)
    geometry = read_scene(bpy.context.scene).geometry
    trajectories = _simulated(options, geometry) if options.fcd is None else _imported(options, geometry)
    trajectories.save(options.output)
    if options.animate is not None:
        animate(bpy.context.scene, trajectories)
        save_blend(options.animate)
    runtime.print_line(f"{options.output}: {_describe(trajectories)}")


def _imported(options: argparse.Namespace, geometry: SceneGeometry) -> Trajectories:
    files = TrafficFiles(options.fcd, tuple(options.routes), options.net, options.start, options.duration)
    loaded = runtime.finish_with_bar(load_traffic(files, geometry))
    runtime.warn(loaded.warnings)
    return loaded.trajectories


def _simulated(options: argparse.Namespace, geometry: SceneGeometry) -> Trajectories:
    duration = SimulationSettings.duration if options.duration is None else options.duration
    settings = SimulationSettings(read_settings(Demand, options), duration=duration, warm_up=options.warm_up)
    run = runtime.finish_with_bar(settings.run(options.simulate, options.seed, geometry))
    runtime.warn(run.warnings)
    if run.collided:
        runtime.LOG.info(
            f"left out of {counted(run.simulated, 'road user')}, having run into others: {len(run.collided)}, "
            f"{listed(run.collided)}"
        )
    return run.trajectories


def _describe(trajectories: Trajectories) -> str:
    begin, end = trajectories.span
    present = len(trajectories.at((begin + end) / 2.0))
    return (
        f"{counted(len(trajectories), 'road user')} ({describe_categories(trajectories)}) from {begin:g} to {end:g} s, "
        f"{counted(len(trajectories.time), 'sample')}, {present} at once halfway"
    )


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("seip traffic", "Put traffic on the road of a scene.")
    parser.add_argument("scene", nargs="?", type=Path, help="the .blend; in Blender the open scene")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="NPZ", help="file for the trajectories")
    parser.add_argument(
        "--animate", type=Path, metavar="BLEND", help="write the scene with this traffic as animated objects"
    )
    parser.add_argument(
        "--duration",
        type=float,
        metavar="S",
        help=f"duration of the trajectories (of FCD all; simulated {SimulationSettings.duration:g})",
    )
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--fcd", type=Path, metavar="FILE", help="SUMO's floating car data: .xml, also as .gz")
    source.add_argument(
        "--simulate", type=Path, metavar="MAP", help="map or network of the scene, on which SUMO simulates traffic"
    )
    reading = parser.add_argument_group("with --fcd")
    reading.add_argument(
        "--routes", nargs="+", type=Path, default=[], metavar="XML", help="files with the vehicle types"
    )
    reading.add_argument("--net", type=Path, metavar="XML", help=".net.xml with the offset from the map")
    reading.add_argument("--start", type=float, metavar="S", help="time at which the trajectories begin (the file's)")
    making = parser.add_argument_group("with --simulate")
    add_settings(making, Demand, "flow", "pedestrians")
    making.add_argument("--seed", type=int, default=0, metavar="N", help="random seed")
    add_settings(making, SimulationSettings, "warm_up")
    return parser


if __name__ == "__main__":
    runtime.run(main)
