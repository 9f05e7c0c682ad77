"""Detections in one cloud: boxes, scores and classes."""

from __future__ import annotations

from dataclasses import dataclass

from seip_addon.core.arrays import Float, Integer


@dataclass(frozen=True, eq=False)
class Detections:
    """Boxes found in one frame, in any order; k boxes.

    Parameters
    ----------
    boxes : (k, 7) float64
        x, y, z of the middle, length, width, height (metres), yaw (radians, counter-clockwise from +x).
    score : (k,) float64, 0 to 1
    category : (k,) int64
        Index into the detector's classes.
    """

    boxes: Float
    score: Float
    category: Integer

    def __len__(self) -> int:
        """Return the number of boxes."""
        return len(self.score)
