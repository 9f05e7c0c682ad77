"""Average precision of a trained detector with the sensors of a scene, on runs of traffic.

seip detect out/placed.blend --traffic run-*.npz -o out/detection
blender -b --python-exit-code 1 out/placed.blend -P headless/detect.py -- --traffic run-*.npz -o out/detection

Needs torch (make detection). The sensors are those of the scene, of any types and at any positions. The detector that
ships with the project was trained on random placements at random sites (`seip study site-training`).
"""

import argparse
import os
import sys
from dataclasses import replace
from itertools import combinations
from pathlib import Path

if not __package__:  # run as a file by `blender -P`
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from headless import runtime
from headless.charts.detection import PrecisionRecallLine, save_parts_chart, save_precision_recall_chart
from headless.charts.error_view import save_error_view
from headless.detection.average_precision import precision_recall, too_few_runs
from headless.detection.breakdown import DISTANCE_EDGES, POINT_EDGES, average_precision_by, recall_by
from headless.detection.chart_data import error_view, parts
from headless.detection.detector import SHIPPED_DETECTOR, Detector, check_device
from headless.detection.detector_evaluation import DetectorEvaluation, evaluate_detector
from headless.detection.inference import seconds_of
from headless.detection.recordings import MountedSensors, Simulator, sampled_runs
from headless.detection.rules import MAIN_RULE
from headless.detection.suitability import suitability_warnings
from headless.detection.training import deterministic
from headless.options import add_optics, add_rolling_shutter, add_settings, new_parser, read_settings, real_number

import bpy
import numpy as np

from seip_addon.core.limits import TIME_STEP
from seip_addon.core.output.datasets.detection_files import kitti_results, openpcdet_results
from seip_addon.core.output.results.detection_record import FORMATS, SCHEMA
from seip_addon.core.output.results.versions import versions
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.sensing.scans.simulation import ScanSettings
from seip_addon.core.sensing.traffic.run_overlap import require_independent, vehicle_positions
from seip_addon.core.sensing.traffic.site_traffic import check_runs, require_own_traffic
from seip_addon.core.site.weather import weather_of
from seip_addon.core.storage.files import digest, save_json, whole_file
from seip_addon.core.storage.json_dataclass import as_json
from seip_addon.core.workflows.survey_settings import SurveySettings
from seip_addon.scene.materials import set_reflectivity
from seip_addon.scene.read import read_scene
from seip_addon.scene.sensors import changed_beams, read_sensors


def main(argv: list[str]) -> None:
    """Scan the runs, detect, and write figures, charts and detections to a folder."""
    options = _parser().parse_args(argv)
    check_device(options.device)
    detector = Detector.load(options.detector, options.device)
    runtime.check_folder(options.output)
    runtime.open_scene(options.scene)
    weather = weather_of(options.weather)
    set_reflectivity(options.reflectivity)
    geometry = weather.over(read_scene(bpy.context.scene).geometry)
    sensors = [
        replace(one, model=weather.through(one.model))
        for one in read_sensors(bpy.context.scene, load_catalogue(options.catalogue))
    ]
    changed = changed_beams(bpy.context.scene, sensors)
    runtime.warn(changed)
    runs = sampled_runs(options.traffic, geometry.origin, options.every)
    for run in runs:
        require_own_traffic(run.trajectories, geometry, run.name)
    if len(runs) > 1:
        moved = [vehicle_positions(run.name, run.trajectories) for run in runs]
        runtime.LOG.info(require_independent(combinations(moved, 2)))
    scans = read_settings(
        ScanSettings, options, weather=tuple(options.weather), reflectivity=tuple(options.reflectivity)
    )
    simulator, placed = Simulator(geometry, scans, sensors), MountedSensors("sensors", tuple(sensors))
    check_runs([run.trajectories for run in runs], simulator.static.region)
    outcome = runtime.finish_with_bar(evaluate_detector(detector, simulator, placed, runs))
    area = simulator.area(detector.settings.pillar)
    doubts = suitability_warnings(detector, placed.types, area, outcome.scan)
    doubts = (*doubts, *filter(None, [too_few_runs(len(runs))]))
    runtime.warn(doubts)
    precisions = outcome.precisions
    with runtime.incomplete_if_interrupted(options.output):
        _save(options.output, outcome, simulator, sensors)
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
    for name, found in precisions.items():
        between = "" if found.interval is None else " ({:.1%} to {:.1%})".format(*found.interval)
        runtime.print_line(f"{name}: AP {found.average_precision:.1%}{between} of {found.road_users:,} road users")
    recall = (f"{name} {one['recall']:.0%} of {one['road_users']:,}" for name, one in outcome.recall.items())
    runtime.print_line(
        f"found at an overlap of {MAIN_RULE.iou:g} with a score of {outcome.score:.2f} or more: {', '.join(recall)}"
    )
    cores = os.cpu_count() or 1
    with deterministic(cores):
        seconds = seconds_of(detector, area, outcome.scan)
    where = options.device if options.device != "cpu" else f"{cores} cores"
    runtime.print_line(f"detection in the fullest frame, {len(outcome.scan):,} returns: {seconds:.2f} s on {where}")
    runtime.print_line(f"written to {options.output}/")


def _save(folder: Path, outcome: DetectorEvaluation, simulator: Simulator, sensors: list[MountedSensor]) -> None:
    """Write the charts, and the detections of each frame."""
    evaluation, score, name = outcome.evaluation, outcome.score, simulator.site
    far = "distance to the nearest sensor (m)"
    panels = [
        parts(far, "average precision", {name: average_precision_by(evaluation, "distance", DISTANCE_EDGES)}),
        parts(far, "recall", {name: recall_by(evaluation, "distance", DISTANCE_EDGES, score)}),
        parts("returns from the road user", "recall", {name: recall_by(evaluation, "points", POINT_EDGES, score)}),
    ]
    save_parts_chart(folder / "where.png", panels, name)
    found = precision_recall(evaluation)
    types = " + ".join(sorted({sensor.model.key for sensor in sensors}))
    line = PrecisionRecallLine(types, len(sensors), found.recall, found.precision, evaluation.average_precision)
    save_precision_recall_chart(folder / "precision_recall.png", [line], name)
    frame = outcome.frames[outcome.fullest]
    places = np.array([sensor.xyz for sensor in sensors])
    title = f"{len(sensors)} × {types}: AP {evaluation.average_precision:.2f} over all frames"
    cloud = outcome.scan.points
    view = error_view(title, frame, MAIN_RULE, score=score, cloud=cloud, region=simulator.static.region, sensors=places)
    where = f"{name}, {frame.run} at {frame.time:.1f} s"
    save_error_view(folder / "errors.png", [view], where, simulator.static.attribution)
    for form in FORMATS:
        for stale in (folder / form).glob("*.txt"):  # of an earlier, longer run
            stale.unlink()
    for number, one in enumerate(outcome.frames):
        boxes, categories, scores = one.detected.boxes, one.detected.category.tolist(), one.detected.score
        for form, lines in zip(FORMATS, (kitti_results, openpcdet_results), strict=True):
            with whole_file(folder / form / f"{number:06d}.txt") as temporary:
                temporary.write_text(lines(boxes, categories, scores), encoding="utf-8")


def _parser() -> argparse.ArgumentParser:
    parser = new_parser("detect", "Compute the average precision of a detector with the sensors of a scene.")
    parser.add_argument("scene", nargs="?", type=Path, help="the .blend with its sensors; in Blender the open scene")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the results")
    parser.add_argument("--traffic", nargs="+", type=Path, required=True, metavar="NPZ", help="runs to detect in")
    parser.add_argument(
        "--detector",
        type=Path,
        default=SHIPPED_DETECTOR,
        metavar="PT",
        help="detector of `seip train` or `seip study site-training` (default: the shipped one)",
    )
    parser.add_argument(
        "--every", type=real_number(TIME_STEP), default=2.5, metavar="S", help="interval between frames"
    )
    parser.add_argument("--device", default="cpu", help="torch device: cpu or cuda")
    add_settings(parser, SurveySettings, "catalogue")
    how = parser.add_argument_group("measurement")
    add_settings(how, ScanSettings, "seed")
    add_rolling_shutter(how)
    add_optics(how)
    add_settings(how, ScanSettings, "engine")
    return parser


if __name__ == "__main__":
    runtime.run(main)
