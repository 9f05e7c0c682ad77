"""Train a detector on simulated scans of a site, and test it on unseen traffic.

seip train site.blend --train out/run-1 out/run-2 --validation out/run-3 --test out/run-4 -o out/detector

The runs are folders of `seip simulate`, each with sensors and traffic of its own: a detector that is trained
on several configurations of sensors works with all of them. A training that was stopped goes on where it was when it
is started again.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import runtime
from headless.charts.detection import save_training_chart
from headless.detection.detection_area import DetectionArea, area_of
from headless.detection.detector import Detector, check_device
from headless.detection.frame_results import FrameResult, frame_result
from headless.detection.frames import SampledRecording, recording_of, require_independent_splits, require_separate
from headless.detection.inference import detect
from headless.detection.rules import precisions
from headless.detection.settings import NetworkSettings, TrainingSettings
from headless.detection.suitability import suitability_warnings
from headless.detection.training import train
from headless.options import add_settings, new_parser, read_settings

import bpy
import numpy as np
from shapely.geometry.base import BaseGeometry

from seip_addon.core.sensing.scans.run_folder import load_manifest
from seip_addon.core.site.scene_geometry import SceneGeometry
from seip_addon.core.storage.files import save_json
from seip_addon.scene.read import read_scene

NETWORK = NetworkSettings()
"""The network of the shipped detector."""


def main(argv: list[str]) -> None:
    """Train a detector, write it to a folder and evaluate it on the test runs."""
    options = _parser().parse_args(argv)
    network, training = NETWORK, read_settings(TrainingSettings, options)
    splits = {
        name: [recording_of(folder) for folder in getattr(options, name)] for name in ("train", "validation", "test")
    }
    require_separate(splits)
    runtime.LOG.info(require_independent_splits(splits))
    check_device(options.device)
    runtime.check_folder(options.output)
    runtime.open_scene(options.scene)
    geometry = read_scene(bpy.context.scene).geometry
    area = area_of(geometry, network.pillar)
    runtime.LOG.info(f"{area.grid.columns} × {area.grid.rows} pillars of {network.pillar:g} m")

    path = options.output / "detector.pt"
    learning, aside = (
        [
            SampledRecording(replace(recording, site=geometry.name), area, network.most_points)
            for recording in splits[name]
        ]
        for name in ("train", "validation")
    )
    trained = runtime.finish_with_bar(train(learning, aside, network, training, device=options.device, store=path))
    best = trained.curve.best
    runtime.print_line(
        f"best after {best:,} steps: average precision {trained.curve.validation[best]:.1%} on validation frames"
    )
    save_training_chart(
        options.output / "training.png", trained.curve.loss, trained.curve.validation, f"{geometry.name}: training"
    )
    if options.test:
        figures = _evaluated(trained.detector, area, options.test, geometry)
        save_json(options.output / "evaluation.json", figures)
    runtime.print_line(f"written to {options.output}/")


def _evaluated(
    detector: Detector, area: DetectionArea, runs: Sequence[Path], geometry: SceneGeometry
) -> dict[str, dict[str, float]]:
    """Return the figures of each run, and say them, with what speaks against trusting them."""
    figures = {}
    for folder in runs:
        recording = recording_of(folder)
        doubts = suitability_warnings(detector, recording.sensors, area, recording.frames[0])
        runtime.warn(f"{folder}: {doubt}" for doubt in doubts)
        results = _results(detector, area, folder, geometry.region)
        by_rule = precisions(results).items()
        figures[str(folder)] = {name: one.average_precision for name, one in by_rule if one.road_users}
        words = ", ".join(f"{name} {value:.1%}" for name, value in figures[str(folder)].items())
        runtime.print_line(f"{folder}: {words}")
    return figures


def _results(detector: Detector, area: DetectionArea, folder: Path, region: BaseGeometry) -> list[FrameResult]:
    """Return what is there and what is detected in each frame of a run."""
    recording = recording_of(folder)
    sensors = np.array([sensor["local_m"] for sensor in load_manifest(folder)["sensors"]])
    return [
        frame_result(frame, detect(detector, area, frame), region=region, sensors=sensors, run=recording.traffic)
        for frame in recording.frames
    ]


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("train", "Train a detector of road users on simulated scans of a site.")
    parser.add_argument("scene", nargs="?", type=Path, help="the site's .blend; in Blender the open scene")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the detector")
    runs = parser.add_argument_group("folders of scans, by runs of traffic")
    runs.add_argument("--train", nargs="+", type=Path, required=True, metavar="RUN", help="runs for training")
    runs.add_argument("--validation", nargs="+", type=Path, required=True, metavar="RUN", help="runs for validation")
    runs.add_argument("--test", nargs="+", type=Path, default=[], metavar="RUN", help="runs for evaluation")
    work = parser.add_argument_group("training")
    add_settings(work, TrainingSettings, "steps", "seed")
    work.add_argument("--device", default="cpu", help="torch device: cpu or cuda")
    return parser


if __name__ == "__main__":
    runtime.run(main)
