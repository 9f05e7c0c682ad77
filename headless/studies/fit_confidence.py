"""Fit the confidence of a detector to recordings with labels, and measure it at sites left out.

python -m headless.studies.fit_confidence DETECTOR.pt SITE=LABELS=DETECTED ...

LABELS is a folder of labels, or the `frames` of `seip simulate`, whose labels are complete; DETECTED is the result of
`seip detect RECORDING`. The map is written next to the detector.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from headless import runtime
from headless.detect_recording import LEAST_CONFIDENCE
from headless.detection.confidence import SUFFIX, Confidence
from headless.detection.detector import Detector
from headless.detection.matching import overlaps
from headless.detection.settings import CLASS_OF, CLASSES
from headless.detection_results import read_detections

import numpy as np

from seip_addon.core.base.arrays import Boolean, Float, Integer
from seip_addon.core.sensing.recordings.box_labels import BoxLabels, read_labels
from seip_addon.core.sensing.scans.frame import Frame
from seip_addon.core.storage.files import natural_order, save_json

OVERLAP = 0.5
"""Intersection over union in plan beyond which a box is a road user of its class."""


Scored = tuple[str, Integer, Float, Boolean]
"""Site of a recording, and its boxes: class, score, and whether each is a road user of its class; (k,) each."""


def main(argv: list[str]) -> None:
    """Print the calibration errors of each recording with its site left out, and write the map of all sites."""
    key, recordings = Detector.load(argv[0]).key, [_scored(*text.split("=")) for text in argv[1:]]
    for site, category, score, true in recordings:
        known = Confidence(key, fitted([other for other in recordings if other[0] != site]))
        sure = np.choose(category, [known.of_class(name, score) for name in CLASSES])
        for name, values in (("score", score), ("confidence", sure)):
            error, listed = calibration_error(values, true), true[values >= LEAST_CONFIDENCE]
            false = f"of {len(listed):,} listed {np.sum(~listed):,} are false"
            runtime.print_line(f"{site}, {name}: calibration error {error:.3f}; {false}")
    sites = tuple(dict.fromkeys(site for site, *_ in recordings))
    save_json(Path(argv[0]).with_suffix(SUFFIX), asdict(Confidence(key, fitted(recordings), sites)))


def _scored(site: str, labels: str, detected: str) -> Scored:
    pairs = [(Path(detected) / "openpcdet").glob("*.txt"), Path(labels).glob("[0-9]*")]
    parts = [_matched(*pair) for pair in zip(*(sorted(paths, key=natural_order) for paths in pairs), strict=True)]
    category, score, true = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    return site, category, score, true


def _matched(detected: Path, labels: Path) -> tuple[Integer, Float, Boolean]:
    """Match the boxes of a frame to its labels, best score first."""
    found, true = read_detections(detected), []
    truth = Frame.load(labels).labels if labels.suffix == ".npz" else read_labels(labels)
    boxes = truth.boxes if isinstance(truth, BoxLabels) else np.column_stack([truth.centre, truth.size, truth.yaw])
    category = [CLASS_OF[name] for name in truth.category.tolist()]
    overlap = overlaps(found.boxes, boxes)
    overlap[found.category[:, None] != np.array(category, dtype=np.int64)] = 0.0
    order = np.argsort(-found.score)
    for row in order:
        true.append(overlap[row].max(initial=0.0) > OVERLAP)
        if true[-1]:
            overlap[:, overlap[row].argmax()] = 0.0
    return found.category[order], found.score[order], np.array(true, dtype=np.bool_)


def fitted(recordings: Sequence[Scored]) -> dict[str, tuple[float, float]]:
    """Return slope and offset of each class with the largest likelihood, by Newton's method.

    Targets are Platt's: shares of true and false boxes with one more of each, which keeps separable classes finite.
    """
    maps, (_, *columns) = {}, zip(*recordings, strict=True)
    category, score, true = map(np.concatenate, columns)
    for number, name in enumerate(CLASSES):
        own, hit = score[category == number], true[category == number]
        target = np.where(hit, (hit.sum() + 1) / (hit.sum() + 2), 1 / ((~hit).sum() + 2))
        inputs, weights = np.column_stack([np.log(own / (1 - own)), np.ones(len(own))]), np.array([1.0, 0.0])
        for _ in range(50):  # about ten suffice
            share = 1 / (1 + np.exp(-inputs @ weights))
            weights += np.linalg.solve((inputs.T * (share * (1 - share))) @ inputs, inputs.T @ (target - share))
        maps[name] = (round(float(weights[0]), 4), round(float(weights[1]), 4))
    return maps


def calibration_error(confidence: Float, true: Boolean) -> float:
    """Return the expected calibration error: mean difference of confidence and share of true boxes in ten bins."""
    group = np.minimum((confidence * 10).astype(np.int64), 9)
    return float(np.abs(np.bincount(group, confidence - true)).sum() / len(true))


if __name__ == "__main__":
    runtime.run(main)
