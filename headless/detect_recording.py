"""Detection in the recording of real sensors; a part of `seip detect`.

seip detect sweeps/ --sensor os1_128 -o out/detected
"""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Generator, Mapping, Sequence
from pathlib import Path
from typing import Any

from headless import runtime
from headless.charts.birds_eye import draw_birds_eye
from headless.detection.average_precision import balanced_score, evaluate
from headless.detection.confidence import Confidence
from headless.detection.detection_area import DetectionArea
from headless.detection.detector import Detector, suitability_warnings
from headless.detection.detector_evaluation import DetectorEvaluation
from headless.detection.frame_results import Detections, EvaluatedBoxes, FrameResult, frame_result
from headless.detection.inference import detect
from headless.detection.matching import Rule
from headless.detection.pillars import grid_over
from headless.detection.rules import MAIN_RULE
from headless.detection.settings import BOTTOM, TOP
from headless.detection.shared_scans import load_frames, save_frames
from headless.detection.traffic_ground import apart, moved_ground
from headless.detection.training import make_deterministic
from headless.detection_results import STORED, print_precision, remove_detections, save_charts, save_detections
from headless.options import real_number

import bpy
import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from seip_addon.core.base.arrays import Boolean, Float
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.limits import Limits
from seip_addon.core.base.progress import Progress
from seip_addon.core.geometry.plan import outline, surface_height
from seip_addon.core.output.results.detection_record import RECORDING_SCHEMA
from seip_addon.core.output.results.versions import versions
from seip_addon.core.sensing.lidar.catalogue import find_models, load_catalogue
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.recordings.box_labels import BoxLabels
from seip_addon.core.sensing.recordings.box_labels import read_labels as read_box_labels
from seip_addon.core.sensing.recordings.poses import read_poses
from seip_addon.core.sensing.recordings.recorded_frames import RecordedFrames, RecordedScene, prepare_frames
from seip_addon.core.sensing.recordings.recording import TIMES_FILE, Recording, open_recording, paired
from seip_addon.core.sensing.scans.frame import Frame
from seip_addon.core.sensing.scans.scanner import ReflectiveSurface
from seip_addon.core.sensing.scans.static_scene import static_scene
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.site.scene_geometry import SceneGeometry, joined
from seip_addon.core.storage.csv_table import save_csv
from seip_addon.core.storage.files import digest, natural_order, save_json, whole_file
from seip_addon.core.storage.json_dataclass import as_json
from seip_addon.core.storage.source_digest import source_digest
from seip_addon.core.workflows.verifying import of_recorded
from seip_addon.scene.read import read_scene
from seip_addon.scene.sensors import read_sensors

LEAST_CONFIDENCE = 0.5
"""Confidence from which detections in recordings are drawn and listed: those that are more likely true than false."""

RADIUS = 80.0
"""Radius of the region around each sensor, metres: the detector was trained on regions of about this size."""

RECORD = "detection.json"

_BLOCKS = 8  # parts of a recording that intervals treat as independent
_LEAST_PER_BLOCK = 2  # frames
_LISTED_OVERLAP, _LISTED_RETURNS = 0.5, 10  # at which listed vehicles count as found

_COLUMNS = (
    *("frame", "time_s", "category", "confidence"),
    *("x_m", "y_m", "z_m", "length_m", "width_m", "height_m", "yaw_deg", "apart"),
)


def add_recording_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of recordings to those of `seip detect`."""
    group = parser.add_argument_group("recordings")
    group.add_argument(
        "--sensor",
        nargs="+",
        default=[],
        metavar="KEY",
        help="model of the sensors, or NAME=KEY for each; NAME is the folder of its sweeps",
    )
    group.add_argument("--poses", type=Path, metavar="FILE", help="poses of the sensors, as JSON")
    group.add_argument(
        "--site", type=Path, metavar="BLEND", help="scene with the sensors: their poses, the road and the map"
    )
    group.add_argument("--labels", type=Path, metavar="DIR", help="labels of each sweep, for average precision")
    group.add_argument(
        "--radius",
        type=real_number(Limits(10.0, 500.0)),
        default=RADIUS,
        metavar="M",
        help="of the region around the sensors",
    )


def is_recording(source: Path | None) -> bool:
    """Return whether a path is a recording rather than a scene."""
    return source is not None and source.suffix.lower() != ".blend"


def detect_recording(options: argparse.Namespace, detector: Detector) -> None:
    """Detect road users in every frame of a recording, and write detections, pictures and figures."""
    runtime.check_folder(options.output)
    recording, models, poses, geometry = _opened(options)
    labels = _labels(options.labels, len(paired(recording)))
    confidence = Confidence.of_detector(options.detector, detector)
    frames = runtime.finish_with_bar(
        prepare_frames(
            recording,
            models,
            poses,
            radius=options.radius,
            scene=None if geometry is None else _scene(geometry),
        )
    )
    _require_vehicle(labels, frames.region, options.labels)
    site = recording.name if geometry is None else geometry.name
    area = area_of_recording(frames, detector, site)
    backgrounds = [(sensor.mounted.label, sensor.background) for sensor in frames.sensors]
    for name, background in backgrounds:
        runtime.LOG.info(background.confidence(name))
    folder = options.output
    remove_detections(folder, since=len(frames))
    with runtime.incomplete_if_interrupted(folder):
        results = runtime.finish_with_bar(_detected(options, frames, detector, area, labels, confidence))
    fullest = max(range(len(results)), key=lambda number: len(results[number].detected))
    scan = frames.frame(fullest)
    doubts = [sentence for name, background in backgrounds for sentence in background.warnings(name)]
    doubts += suitability_warnings(detector, [one.key for one in models.values()], site)
    if any(sensor.intensity_scale is None for sensor in frames.sensors):
        doubts.append(
            "the recording has no intensities: all points get the same one, and fewer road users may be found"
        )
    runtime.warn(doubts)
    confident = [confidence.applied(one) for one in results]
    beside = _apart(confident, geometry)
    listed = _save_table(folder / "detections.csv", confident, beside, geometry)
    outcome = _evaluated(results, fullest, scan) if labels is not None else None
    record: dict[str, Any] = {
        "schema": RECORDING_SCHEMA,
        "recording": recording.name,
        "frames": len(frames),
        "sensors": [
            {
                "id": one.mounted.label,
                "sensor": one.mounted.model.key,
                "local_m": one.mounted.xyz.tolist(),
                "orientation": one.mounted.orientation.tolist(),
                "intensity_scale": one.intensity_scale,
                "background": {
                    "sweeps": one.background.sweeps,
                    "seconds": one.background.seconds,
                    "uncertain": one.background.uncertain,
                },
            }
            for one in frames.sensors
        ],
        "confidence": LEAST_CONFIDENCE,
        "calibrated_on": list(confidence.recordings),
        "apart": int(sum(one.sum() for one in beside)),
        "detector": detector.description() | {"digest": digest(options.detector.read_bytes())},
        "warnings": doubts,
        "versions": versions(blender=bpy.app.version_string),
    }
    if outcome is not None:
        save_charts(folder, outcome, site, frames.region, [one.mounted for one in frames.sensors])
        record["average_precision"] = {name: as_json(found) for name, found in outcome.precisions.items()}
        record["recall"] = {"score": outcome.score, "categories": outcome.recall}
        record["listed"] = _listed(confident)
        print_precision(outcome)
        _print_listed(record["listed"])
    save_json(folder / RECORD, record)
    runtime.print_line(
        f"{listed:,} road users with a confidence of {LEAST_CONFIDENCE:g} or more in {len(frames):,} frames"
    )
    if record["apart"]:
        ground = "off the scene's road" if geometry else "standing where no vehicle was seen to move"
        runtime.print_line(f"{record['apart']:,} of them are vehicles {ground}, often false: column apart")
    runtime.print_line(f"written to {folder}/: detections.csv, frames/, kitti/, openpcdet/")


def _detected(
    options: argparse.Namespace,
    frames: RecordedFrames,
    detector: Detector,
    area: DetectionArea,
    labels: Sequence[BoxLabels] | None,
    confidence: Confidence,
) -> Generator[Progress, None, list[FrameResult]]:
    """Detect in each frame, write detections and picture, and return the results.

    Results have ground truth where the frames have labels. The result of a frame is stored last, under a digest of all
    that it follows from, so that work that was stopped goes on.
    """
    total, folder, ground = len(frames), options.output, frames.ground
    blocks = _BLOCKS if total >= _BLOCKS * _LEAST_PER_BLOCK else 1
    places = np.array([sensor.mounted.xyz for sensor in frames.sensors])
    inputs = (source_digest("headless"), repr(confidence), area.site, places, frames.region.wkb)
    common = digest(*inputs, ground.low, ground.step, ground.heights)
    results = []
    make_deterministic(os.cpu_count() or 1)
    for number in range(total):
        yield Progress(number, total, "detecting")
        frame = frames.frame(number, None if labels is None else labels[number])
        run = f"part {number * blocks // total + 1}" if blocks > 1 else "recording"
        key = digest(common, run, frame.time, *_arrays(frame), *_arrays(frame.labels))
        stored = folder / STORED / f"{number:06d}-{key[:32]}.npz"
        if stored.exists():
            results += load_frames(stored)
            continue
        remove_detections(folder, number)
        found = _inside(detect(detector, area, frame), frames)
        result = frame_result(frame, found, region=frames.region, sensors=places, run=run)
        picture = folder / "frames" / f"{number:06d}.png"
        _save_picture(picture, frame, confidence.applied(result).detected, frames, area.site)
        save_detections(folder, number, found.boxes, result.detected.category.tolist(), found.score)
        save_frames(stored, [result])
        results.append(result)
    yield Progress(total, total, "detecting")
    return results


def _arrays(holder: object) -> list[NDArray[Any]]:
    return [value for value in vars(holder).values() if isinstance(value, np.ndarray)]


def area_of_recording(frames: RecordedFrames, detector: Detector, name: str) -> DetectionArea:
    """Return the detection area of a recording: its region, with heights above the estimated ground."""
    west, south, east, north = map(float, frames.region.bounds)
    grid = grid_over((west, south, east, north), (BOTTOM, TOP), detector.settings.pillar)
    return DetectionArea(grid, frames.ground, name)


def _inside(found: Detections, frames: RecordedFrames) -> Detections:
    """Return the detections in the region."""
    inside = shapely.contains_xy(frames.region, found.boxes[:, 0], found.boxes[:, 1])
    return Detections(found.boxes[inside], found.score[inside], found.category[inside])


def _opened(
    options: argparse.Namespace,
) -> tuple[Recording, dict[str, LidarModel], dict[str, Float], SceneGeometry | None]:
    """Open the recording; return it with the models and poses of its sensors, and their scene, if any."""
    catalogue = load_catalogue(options.catalogue)
    if options.site is not None:
        if options.sensor or options.poses:
            raise SeipError("--site names the sensors with their poses: leave out --sensor and --poses")
        runtime.open_scene(options.site)
        geometry = read_scene(bpy.context.scene).geometry
        placed = {one.label: one for one in read_sensors(bpy.context.scene, catalogue)}
        if not placed:
            raise SeipError(f"{options.site} has no sensors: give a placed scene, or --sensor and --poses")
        recording = open_recording(options.scene, min(one.model.rotation_rate for one in placed.values()))
        own = of_recorded(recording, placed, str(options.site))
        poses = {name: _pose(one.xyz, one.orientation) for name, one in own.items()}
        return recording, {name: one.model for name, one in own.items()}, poses, geometry
    if not options.sensor:
        raise SeipError("name the sensor that made the recording, as --sensor os1_128, or the scene with --site")
    named = dict(_split(text) for text in options.sensor)
    models = find_models(catalogue, list(named.values()))
    recording = open_recording(options.scene, min(model.rotation_rate for model in models.values()))
    for record in recording.sensors:
        if record.name not in named and "" not in named:
            raise SeipError(f"--sensor names no model for {record.name}: add {record.name}=KEY")
    found = {record.name: models[named[record.name if record.name in named else ""]] for record in recording.sensors}
    known = {} if options.poses is None else of_recorded(recording, read_poses(options.poses), str(options.poses))
    return recording, found, known, None


def _scene(geometry: SceneGeometry) -> RecordedScene:
    """Return the surfaces, the road and the region of a scene."""
    static, road = static_scene(geometry), joined(geometry.roads)
    surface = ReflectiveSurface(make_ray_caster(static.triangles), static.reflectivity)
    return RecordedScene(surface, lambda xy: surface_height(xy, road), geometry.region)


def _split(text: str) -> tuple[str, str]:
    name, equals, key = text.rpartition("=")
    return (name, key) if equals else ("", text)


def _pose(xyz: Float, orientation: Float) -> Float:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = orientation, xyz
    return pose


def _labels(folder: Path | None, frames: int) -> list[BoxLabels] | None:
    """Read one file of labels for each frame, in the order of their names."""
    if folder is None:
        return None
    named = (path for path in folder.glob("*") if path.suffix.lower() == ".txt" and path.name != TIMES_FILE)
    files = sorted(named, key=natural_order)
    if len(files) != frames:
        raise SeipError(
            f"{folder} has {len(files)} files of labels, but the recording has {frames} frames: give one for each"
        )
    return [read_box_labels(path) for path in files]


def _require_vehicle(labels: Sequence[BoxLabels] | None, region: BaseGeometry, folder: Path) -> None:
    """Refuse labels without average precision before anything is written."""
    for one in labels or ():
        inside = shapely.contains_xy(region, one.boxes[:, 0], one.boxes[:, 1])
        if np.isin(one.category[inside], MAIN_RULE.categories).any():
            return
    if labels is not None:
        raise SeipError(
            f"no file of {folder} has a {' or '.join(MAIN_RULE.categories)} in the region: give labels in the axes of "
            "the site, or a larger --radius"
        )


def _save_picture(path: Path, frame: Frame, found: EvaluatedBoxes, frames: RecordedFrames, site: str) -> None:
    """Write the picture of a frame with the listed ones of its detections, whose scores are their confidence."""
    shown = found.score >= LEAST_CONFIDENCE
    west, south, east, north = frames.region.bounds
    picture = draw_birds_eye(
        frame.points,
        frame.foreground,
        (west, south, east, north),
        boxes=found.boxes[shown],
        categories=found.category[shown].tolist(),
        sensors=np.array([sensor.mounted.xyz for sensor in frames.sensors]),
        region=frames.region,
        title=f"{site}, {frame.time:.1f} s",
    )
    with whole_file(path) as temporary:
        picture.save(temporary, "PNG")


def _apart(results: Sequence[FrameResult], geometry: SceneGeometry | None) -> list[Boolean]:
    """Return for each frame which of its listed detections (k,) are vehicles beside the ground of traffic.

    That is the road of the scene, and where vehicles were seen to move. None are if that cannot be seen.
    """
    ground = moved_ground(results, LEAST_CONFIDENCE)
    if geometry is not None:
        ground = ground.union(outline(joined(geometry.roads)))
    elif ground.is_empty:
        return [np.zeros(len(one.detected.score), dtype=bool) for one in results]
    return [apart(one.detected, ground) & (one.detected.score >= LEAST_CONFIDENCE) for one in results]


def _save_table(
    path: Path, results: Sequence[FrameResult], beside: Sequence[Boolean], geometry: SceneGeometry | None
) -> int:
    """Write the listed detections with their confidence as CSV and return their number.

    Latitude and longitude are columns only if the map has them.
    """
    rows: list[list[object]] = []
    georeferenced = geometry is not None and geometry.geo_reference.mercator is not None
    for number, result in enumerate(results):
        found = result.detected
        kept = np.flatnonzero(found.score >= LEAST_CONFIDENCE)
        where = None
        if georeferenced and geometry is not None and len(kept):
            where = geometry.geo_reference.geographic(found.boxes[kept, :3] + geometry.origin)
        for row, one in enumerate(kept.tolist()):
            x, y, z, length, width, height, yaw = found.boxes[one].tolist()
            sizes = [f"{value:.3f}" for value in (x, y, z, length, width, height)]
            place = [] if where is None else [f"{where[row, 1]:.7f}", f"{where[row, 0]:.7f}"]
            angle = f"{math.degrees(yaw):.1f}"
            rows.append(
                [
                    *(number, f"{result.time:.3f}", found.category[one], f"{found.score[one]:.3f}", *sizes, angle),
                    *("yes" if beside[number][one] else "", *place),
                ]
            )
    save_csv(path, (*_COLUMNS, "latitude", "longitude") if georeferenced else _COLUMNS, rows)
    return len(rows)


def _listed(results: Sequence[FrameResult]) -> dict[str, float | int | None]:
    """Return the false vehicles per frame that are listed, and the share found of the vehicles with enough returns."""
    evaluation = evaluate(results, Rule(iou=_LISTED_OVERLAP))
    false = ~evaluation.detections.hit & (evaluation.detections.score >= LEAST_CONFIDENCE)
    wanted = evaluation.wanted.points >= _LISTED_RETURNS
    found = evaluation.wanted.score[wanted] >= LEAST_CONFIDENCE
    return {
        "confidence": LEAST_CONFIDENCE,
        "overlap": _LISTED_OVERLAP,
        "false_per_frame": float(false.sum()) / len(results),
        "fewest_returns": _LISTED_RETURNS,
        "road_users": len(found),
        "found": float(found.mean()) if len(found) else None,
    }


def _print_listed(listed: Mapping[str, float | int | None]) -> None:
    runtime.print_line(
        f"vehicles with a confidence of {listed['confidence']:g} or more: "
        f"{listed['false_per_frame']:.2f} false ones per frame"
    )
    if listed["found"] is not None:
        runtime.print_line(
            f"{listed['found']:.0%} found of the {listed['road_users']:,} with {listed['fewest_returns']} returns or "
            f"more, at an overlap of {listed['overlap']:g}"
        )


def _evaluated(results: Sequence[FrameResult], fullest: int, scan: Frame) -> DetectorEvaluation:
    evaluation = evaluate(results, MAIN_RULE)
    return DetectorEvaluation(tuple(results), evaluation, fullest, scan, balanced_score(evaluation))
