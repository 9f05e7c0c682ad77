"""Coverage after the failure of a sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Boolean


@dataclass(frozen=True)
class Failures:
    """Share of the targets that is still seen when each sensor fails.

    Parameters
    ----------
    left : tuple of float
        In the order of the sensors.
    """

    left: tuple[float, ...]

    @property
    def worst(self) -> float:
        """Coverage after the worst failure."""
        return min(self.left)

    @property
    def mean(self) -> float:
        """Mean coverage over the failures of each sensor."""
        return sum(self.left) / len(self.left)


def failures(seen: Boolean) -> Failures | None:
    """Return what is left when a sensor fails, None where there is none.

    Parameters
    ----------
    seen : (k, t) bool
        What each sensor sees.
    """
    if not len(seen):
        return None
    times = seen.sum(axis=0)
    return Failures(tuple(float(np.count_nonzero(times - row > 0)) / seen.shape[1] for row in seen))
