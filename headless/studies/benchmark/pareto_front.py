"""Pareto front of error against run time, and exponents of growth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Method:
    """A method with its run time and error.

    Parameters
    ----------
    family : str
        Ways of one family look alike in a chart.
    seconds : float
        Of processor time.
    error : float
        0 for an exact answer.
    default : bool
        Whether it is what is done unless one asks for another.
    interval : tuple of two float, optional
        95 % interval of the error.
    """

    name: str
    family: str
    seconds: float
    error: float
    default: bool = False
    interval: tuple[float, float] | None = None


def front(ways: Sequence[Method]) -> list[Method]:
    """Return the Pareto front of methods by run time and error, the quickest first."""
    best: list[Method] = []
    for way in sorted(ways, key=lambda w: (w.seconds, w.error)):
        if not best or way.error < best[-1].error:
            best.append(way)
    return best


def growth_exponent(size: Sequence[float], cost: Sequence[float]) -> float:
    """Return b of the power law cost = a · size**b that fits best, by least squares of the logarithms."""
    slope, _ = np.polyfit(np.log(size), np.log(cost), 1)
    return float(slope)
