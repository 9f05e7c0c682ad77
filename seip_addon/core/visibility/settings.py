"""Settings of visibility: when a target counts as seen."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import SeipError
from ..settings import setting

MAX_DELTA = 100.0
"""Metres; a larger δ is taken for a typing error."""


@dataclass(frozen=True)
class VisibilitySettings:
    """When a target counts as seen.

    Parameters
    ----------
    delta : float, metres
        A return nearer than this to a target sees it.
    min_intensity : float, 0 to 1
        Least intensity of such a return, for surfaces of reflectivity 1. At 0 every return counts.
    """

    delta: float = setting(1.0, "distance from a target within which a return sees it", unit="m", maximum=MAX_DELTA)
    min_intensity: float = setting(
        0.0, "least intensity of a return that sees; at 0 every return counts", minimum=0.0, maximum=1.0, metavar="I"
    )

    def __post_init__(self) -> None:
        if not 0 < self.delta <= MAX_DELTA:
            raise SeipError(f"delta must be a positive number of metres up to {MAX_DELTA:g}, not {self.delta}")
        if not 0 <= self.min_intensity <= 1:
            raise SeipError(f"the least intensity must lie between 0 and 1, not {self.min_intensity}")
