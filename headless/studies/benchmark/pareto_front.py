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
        Methods of one family have the same colour and mark in a chart.
    seconds : float
        Processor time.
    error : float
        Error of the result; 0 if exact.
    default : bool
        Whether the method is the default.
    interval : tuple of two float, optional
        95 % interval of the error.
    """

    name: str
    family: str
    seconds: float
    error: float
    default: bool = False
    interval: tuple[float, float] | None = None


def front(methods: Sequence[Method]) -> list[Method]:
    """Return the Pareto front of methods by run time and error, the fastest first."""
    best: list[Method] = []
    for method in sorted(methods, key=lambda one: (one.seconds, one.error)):
        if not best or method.error < best[-1].error:
            best.append(method)
    return best


def growth_exponent(size: Sequence[float], cost: Sequence[float]) -> float:
    """Return the exponent b of the power law cost = a · size**b, fitted by least squares of the logarithms."""
    slope, _ = np.polyfit(np.log(size), np.log(cost), 1)
    return float(slope)
