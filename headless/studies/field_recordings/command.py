"""Verification of installations that differ from their plans in known ways.

seip study field-recordings placed.blend --traffic run-*.npz -o out/field --draws 20
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Generator, Sequence
from dataclasses import replace
from pathlib import Path

from headless import runtime
from headless.detection.recordings import SampledRun, sampled_runs
from headless.options import new_parser, whole_number
from headless.studies.field_recordings.changed_site import changed_site, record_sweeps
from headless.studies.field_recordings.draws import Draw, describe, draw_of, save_draws

import bpy
import numpy as np

from seip_addon.core.limits import Limits
from seip_addon.core.progress import Progress
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.recordings.recording import open_recording
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.workflows.verifying import verify
from seip_addon.scene.read import read_scene
from seip_addon.scene.sensors import read_sensors

INTERVAL = 1.5
"""Seconds between sweeps."""
EXAMPLE_SWEEPS = 20
_SPACING = 1.0


def main(argv: list[str]) -> None:
    """Draw installations, record and verify each, and write the errors; or write one recording as an example."""
    options = _parser().parse_args(argv)
    runtime.check_folder(options.output)
    runtime.open_scene(options.scene)
    geometry = read_scene(bpy.context.scene).geometry
    planned = read_sensors(bpy.context.scene, load_catalogue(()))
    runs = sampled_runs(options.traffic, geometry.origin, INTERVAL)
    if options.example:
        site = changed_site(geometry, planned, np.random.default_rng(options.seed))
        run = replace(runs[0], times=runs[0].times[:EXAMPLE_SWEEPS])
        record_sweeps(options.output, site, run, options.seed, compressed=True)
        runtime.print_line(f"{site.gone} is gone, trees at {site.trees.round(1).tolist()}")
        return
    draws = runtime.finish_with_bar(_draws(geometry, planned, runs, options.draws, options.seed))
    with runtime.incomplete_if_interrupted(options.output):
        save_draws(options.output / "draws.json", draws)
    for line in describe(draws):
        runtime.print_line(line)


def _draws(
    geometry: SceneGeometry,
    planned: tuple[MountedSensor, ...],
    runs: Sequence[SampledRun],
    count: int,
    seed: int,
) -> Generator[Progress, None, list[Draw]]:
    found = []
    for number in range(count):
        yield Progress(number, count, "verifying installations")
        site = changed_site(geometry, planned, np.random.default_rng([seed, number]))
        with tempfile.TemporaryDirectory() as folder:
            record_sweeps(Path(folder), site, runs[number % len(runs)], number)
            recording = open_recording(Path(folder), planned[0].model.rotation_rate)
            verification = yield from verify(geometry, planned, recording, VisibilitySettings(), spacing=_SPACING)
        found.append(draw_of(verification, planned, site))
    yield Progress(count, count, "verifying installations")
    return found


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("study field-recordings", "Verify installations that differ from their plans in known ways.")
    parser.add_argument("scene", type=Path, help="the .blend of the plan, with its sensors")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the results")
    parser.add_argument("--traffic", nargs="+", type=Path, required=True, metavar="NPZ", help="runs of traffic")
    parser.add_argument("--draws", type=whole_number(Limits(1, 1000)), default=20, metavar="N", help="installations")
    parser.add_argument("--seed", type=whole_number(Limits(0, 1 << 31)), default=1, help="seed of the draws")
    parser.add_argument("--example", action="store_true", help="only write the recording of one installation")
    return parser
