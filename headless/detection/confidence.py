"""Confidence of detections in recordings: the probability that a box is a road user of its class.

Scores of a detector rank its boxes, but are not probabilities. An increasing map for each class converts them [1]_.

.. [1] J. Platt, "Probabilistic Outputs for Support Vector Machines and Comparisons to Regularized Likelihood Methods",
   Advances in Large Margin Classifiers, 1999.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from seip_addon.core.base.arrays import Float
from seip_addon.core.base.errors import SeipError
from seip_addon.core.storage.json_dataclass import read_record

from .detector import Detector
from .frame_results import FrameResult
from .settings import CLASS_OF, CLASSES

SCHEMA = "seip-confidence/1"
SUFFIX = ".confidence.json"
"""Ending of the file next to a detector's, in place of ``.pt``."""


@dataclass(frozen=True)
class Confidence:
    """Logistic map of scores for each class: 1 / (1 + exp(-offset - slope · ln(score / (1 - score)))).

    Parameters
    ----------
    detector : str
        Key of the detector.
    maps : mapping of str to (float, float)
        Slope, which is positive, and offset of each class of detectors.
    recordings : tuple of str
        Recordings that it was fitted to; empty if confidence is the score.
    """

    detector: str
    maps: Mapping[str, tuple[float, float]]
    recordings: tuple[str, ...] = ()
    schema: str = SCHEMA

    @classmethod
    def of_detector(cls, path: Path, detector: Detector) -> Confidence:
        """Read the file next to a detector's file; without one, confidence is the score."""
        path = path.with_suffix(SUFFIX)
        cure = "fit it again with headless/studies/fit_confidence.py, or remove it"
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            return cls(detector.key, dict.fromkeys(CLASSES, (1.0, 0.0)))
        except OSError as error:
            raise SeipError(f"cannot read {path.name}: {error.strerror}; {cure}") from error
        known = read_record(cls, content, (SCHEMA,), path.name, cure)
        if known.detector != detector.key:
            raise SeipError(f"{path.name} belongs to another detector: {cure}")
        if set(known.maps) != set(CLASSES) or min(slope for slope, _ in known.maps.values()) <= 0.0:
            raise SeipError(f"{path.name} needs a positive slope for each of {', '.join(CLASSES)}: {cure}")
        return known

    def of_class(self, name: str, score: Float) -> Float:
        """Return the confidence of boxes of a class from their scores, (k,) each."""
        slope, offset = self.maps[name]
        with np.errstate(divide="ignore"):  # scores of 0 and 1 have a confidence of 0 and 1
            found: Float = 1.0 / (1.0 + np.exp(-offset) * ((1.0 - score) / score) ** slope)
        return found

    def applied(self, result: FrameResult) -> FrameResult:
        """Return a frame with the confidence of its detections in place of their scores."""
        detected, sure = result.detected, result.detected.score.copy()
        number = np.array([CLASS_OF[category] for category in detected.category.tolist()], dtype=np.int64)
        for index, name in enumerate(CLASSES):
            sure[number == index] = self.of_class(name, detected.score[number == index])
        return replace(result, detected=replace(detected, score=sure))
