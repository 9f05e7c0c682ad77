"""Detection of road users in simulated scans of a scene's sensors, or in a recording of real sensors.

seip detect out/placed.blend --traffic run-*.npz -o out/detection
seip detect sweeps/ --sensor os1_128 -o out/detected
blender -b --python-exit-code 1 out/placed.blend -P headless/detect.py -- --traffic run-*.npz -o out/detection

Needs torch (make detection). The sensors are those of the scene, of any types and at any positions. The detector that
ships with the project was trained on random placements at random sites (`seip study site-training`).
"""

import argparse
import sys
from itertools import combinations
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import runtime
from headless.detect_recording import add_recording_options, detect_recording, is_recording
from headless.detection.average_precision import too_few_runs
from headless.detection.detector import SHIPPED_DETECTOR, Detector, check_device, suitability_warnings
from headless.detection.detector_evaluation import evaluate_detector
from headless.detection.recordings import MountedSensors, Simulator, sampled_runs
from headless.detection_results import (
    print_precision,
    remove_detections,
    save_charts,
    save_detections,
)
from headless.options import add_settings, add_weather, new_parser, read_settings, real_number, refuse_idle
from headless.scanned_scene import read_scanned_scene

import bpy

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.limits import TIME_STEP
from seip_addon.core.output.results.detection_record import SCHEMA
from seip_addon.core.output.results.versions import versions
from seip_addon.core.sensing.scans.simulation import ScanSettings
from seip_addon.core.sensing.traffic.run_overlap import require_independent, vehicle_positions
from seip_addon.core.sensing.traffic.site_traffic import check_runs, require_own_traffic
from seip_addon.core.storage.files import digest, save_json
from seip_addon.core.storage.json_dataclass import as_json
from seip_addon.core.workflows.survey_settings import SurveySettings
from seip_addon.scene.sensors import changed_beams

_OF_SCENES = ("traffic", "every", "seed", "weather")
_OF_RECORDINGS = ("sensor", "poses", "site", "labels", "radius")


def main(argv: list[str]) -> None:
    """Scan the runs, detect, and write figures, charts and detections to a folder."""
    parser = _parser()
    options = parser.parse_args(argv)
    recorded = is_recording(options.scene)
    idle, use = (_OF_SCENES, "scene with traffic") if recorded else (_OF_RECORDINGS, "recording")
    refuse_idle(parser, options, idle, f"a {use}")
    check_device(options.device)
    detector = Detector.load(options.detector, options.device)
    if recorded:
        detect_recording(options, detector)
        return
    if not options.traffic:
        raise SeipError("name the runs of traffic to detect in with --traffic, or a recording in place of the scene")
    runtime.check_folder(options.output)
    runtime.open_scene(options.scene)
    reading, sensors = read_scanned_scene(options)
    geometry = reading.geometry
    changed = changed_beams(bpy.context.scene, sensors)
    runtime.warn(changed)
    runs = sampled_runs(options.traffic, geometry.origin, options.every)
    for run in runs:
        require_own_traffic(run.trajectories, geometry, run.name)
    if len(runs) > 1:
        moved = [vehicle_positions(run.name, run.trajectories) for run in runs]
        runtime.LOG.info(require_independent(combinations(moved, 2)))
    scans = read_settings(ScanSettings, options, rolling_shutter=True, weather=tuple(options.weather))
    simulator, placed = Simulator(geometry, scans, sensors), MountedSensors("sensors", tuple(sensors))
    check_runs([run.trajectories for run in runs], simulator.static.region)
    outcome = runtime.finish_with_bar(evaluate_detector(detector, simulator, placed, runs))
    doubts = suitability_warnings(detector, placed.types, geometry.name)
    doubts = (*doubts, *filter(None, [too_few_runs(len(runs))]))
    runtime.warn(doubts)
    precisions = outcome.precisions
    with runtime.incomplete_if_interrupted(options.output):
        static = simulator.static
        save_charts(options.output, outcome, geometry.name, static.region, sensors, static.attribution)
        remove_detections(options.output)
        for number, one in enumerate(outcome.frames):
            found = one.detected
            save_detections(options.output, number, found.boxes, found.category.tolist(), found.score)
        record = {
            "schema": SCHEMA,
            "site": geometry.name,
            "sensors": [{"id": one.label, "sensor": one.model.key, "local_m": one.xyz.tolist()} for one in sensors],
            "traffic": [{"name": run.name, "key": run.key, "frames": len(run.times)} for run in runs],
            "detector": detector.description() | {"digest": digest(options.detector.read_bytes())},
            "scans": {"seed": scans.seed, "rolling_shutter": scans.rolling_shutter},
            "average_precision": {name: as_json(found) for name, found in precisions.items()},
            "score": outcome.score,
            "recall": outcome.recall,
            "warnings": [*changed, *doubts],
            "versions": versions(blender=bpy.app.version_string),
        }
        save_json(options.output / "detection.json", record)
    print_precision(outcome)
    runtime.print_line(f"written to {options.output}/")


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("seip detect", "Detect road users in simulated scans of a scene, or in a recording.")
    parser.add_argument(
        "scene", nargs="?", type=Path, help="the .blend with its sensors (in Blender the open scene), or a recording"
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the results")
    parser.add_argument("--traffic", nargs="+", type=Path, default=[], metavar="NPZ", help="runs to detect in")
    parser.add_argument(
        "--detector",
        type=Path,
        default=SHIPPED_DETECTOR,
        metavar="PT",
        help="detector of `seip study site-training` (default: the shipped one)",
    )
    parser.add_argument(
        "--every", type=real_number(TIME_STEP), default=2.5, metavar="S", help="interval between frames"
    )
    parser.add_argument("--device", default="cpu", help="torch device: cpu or cuda")
    add_settings(parser, SurveySettings, "catalogue")
    add_recording_options(parser)
    how = parser.add_argument_group("measurement")
    add_settings(how, ScanSettings, "seed")
    add_weather(how)
    return parser


if __name__ == "__main__":
    runtime.run(main)
