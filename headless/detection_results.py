"""Files and lines with the results of a detector: charts, detections of each frame, average precision."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from headless import runtime
from headless.charts.detection import BinnedFigure, save_parts_chart, save_precision_recall_chart
from headless.charts.error_view import ErrorView, save_error_view
from headless.detection.average_precision import precision_recall
from headless.detection.breakdown import DISTANCE_EDGES, POINT_EDGES, average_precision_by, recall_by
from headless.detection.detector_evaluation import DetectorEvaluation
from headless.detection.frame_results import Detections, FrameResult
from headless.detection.matching import NO_MATCH, Rule, match
from headless.detection.rules import MAIN_RULE
from headless.detection.settings import CLASS_OF

import numpy as np
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from seip_addon.core.base.arrays import Float
from seip_addon.core.output.datasets.formats import CLASSES, kitti_results, openpcdet_results, read_labels
from seip_addon.core.output.results.detection_record import FORMATS
from seip_addon.core.sensing.scans.sensor import MountedSensor
from seip_addon.core.storage.files import whole_file

STORED = "stored"
"""Folder of the results of frames of a recording, from which a run that was stopped goes on."""
PLAN_COLUMNS = [0, 1, 3, 4, 6]


def error_view(  # noqa: PLR0913 - a frame, how it is evaluated, and where it is
    name: str,
    frame: FrameResult,
    rule: Rule,
    *,
    score: float,
    cloud: NDArray[np.float32],
    region: BaseGeometry,
    sensors: Float,
) -> ErrorView:
    """Return a frame with the detections of at least some score, and what of them is wrong.

    Parameters
    ----------
    cloud : (n, 3) float32, metres
    region : shapely geometry
    sensors : (s, 3) float64, metres
    """
    kept = frame.detected.score >= score
    columns = {column: values[kept] for column, values in vars(frame.detected).items()}
    shown = replace(frame, detected=replace(frame.detected, **columns))
    found = match(shown, rule)
    return ErrorView(
        name=name,
        cloud=cloud[:, :2].astype(np.float64),
        region=region,
        sensors=sensors[:, :2],
        truth=frame.truth.boxes[:, PLAN_COLUMNS],
        wanted=found.counted,
        missed=found.counted & (found.detection == NO_MATCH),
        detected=shown.detected.boxes[:, PLAN_COLUMNS],
        false=found.evaluated & ~found.hit,
    )


def save_charts(
    folder: Path,
    outcome: DetectorEvaluation,
    name: str,
    region: BaseGeometry,
    sensors: Sequence[MountedSensor],
    attribution: Sequence[str] = (),
) -> None:
    """Write the charts of average precision and of the errors in the fullest frame.

    Parameters
    ----------
    name : str
        Name of the site, for titles.
    region : shapely geometry, metres
        Region of interest in plan.
    attribution : sequence of str
        Credits that the sources of the scene require.
    """
    evaluation, score = outcome.evaluation, outcome.score
    far = "distance to the nearest sensor (m)"
    panels: list[BinnedFigure] = [
        (far, "average precision", average_precision_by(evaluation, "distance", DISTANCE_EDGES)),
        (far, "recall", recall_by(evaluation, "distance", DISTANCE_EDGES, score)),
        ("returns from the road user", "recall", recall_by(evaluation, "points", POINT_EDGES, score)),
    ]
    save_parts_chart(folder / "where.png", panels, name)
    types = " + ".join(sorted({sensor.model.key for sensor in sensors}))
    count = len(sensors)
    label = f"{count} × {types}: AP {evaluation.average_precision:.2f}"
    _, precision, recall = precision_recall(evaluation)
    save_precision_recall_chart(folder / "precision_recall.png", recall, precision, label, name)
    frame = outcome.frames[outcome.fullest]
    places = np.array([sensor.xyz for sensor in sensors])
    cloud = outcome.scan.points
    view = error_view(
        f"{label} over all frames", frame, MAIN_RULE, score=score, cloud=cloud, region=region, sensors=places
    )
    save_error_view(folder / "errors.png", [view], f"{name}, {frame.run} at {frame.time:.1f} s", attribution)


def save_detections(folder: Path, number: int, boxes: Float, categories: Sequence[str], score: Float) -> None:
    """Write the detections of a frame in each format; see `kitti_results`."""
    for form, lines in zip(FORMATS, (kitti_results, openpcdet_results), strict=True):
        with whole_file(folder / form / f"{number:06d}.txt") as temporary:
            temporary.write_text(lines(boxes, categories, score), encoding="utf-8")


def read_detections(path: Path) -> Detections:
    """Read the detections of a frame from their file in the format of OpenPCDet."""
    boxes, names = read_labels(path)
    scores = [float(line.split()[8]) for line in path.read_text(encoding="utf-8").splitlines()]
    category = {name: CLASS_OF[category] for category, name in CLASSES.items()}
    return Detections(boxes, np.array(scores), np.array([category[name] for name in names], dtype=np.int64))


def remove_detections(folder: Path, number: int | None = None, *, since: int = 0) -> None:
    """Remove the files of frames that an earlier run has written: of one frame, or of all from a number on."""
    for form in (*FORMATS, "frames", STORED):
        for stale in (folder / form).glob("[0-9]*.*" if number is None else f"{number:06d}*"):
            if stale.name[:6].isdecimal() and int(stale.name[:6]) >= since:
                stale.unlink()


def print_precision(outcome: DetectorEvaluation) -> None:
    """Print average precision by rule, and recall by category."""
    for name, found in outcome.precisions.items():
        between = "" if found.interval is None else " ({:.1%} to {:.1%})".format(*found.interval)
        runtime.print_line(f"{name}: AP {found.average_precision:.1%}{between} of {found.road_users:,} road users")
    recall = (f"{name} {one['recall']:.0%} of {one['road_users']:,}" for name, one in outcome.recall.items())
    runtime.print_line(
        f"found at an overlap of {MAIN_RULE.iou:g} with a score of {outcome.score:.2f} or more: {', '.join(recall)}"
    )
