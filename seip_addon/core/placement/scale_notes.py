"""Notes on weights and prices too small to decide beside the others."""

from __future__ import annotations

import numpy as np

from .instance import common_unit
from .problem import TIE, PlacementProblem


def scale_notes(problem: PlacementProblem) -> tuple[str, ...]:
    """Say which targets and prices cannot decide because others are too large.

    Returns
    -------
    tuple of str
        One sentence for weights and one for prices, where there is anything to say.
    """
    notes = []
    weights = problem.weights[problem.weights > 0]
    light = int(np.count_nonzero(weights < TIE * weights.sum()))
    if light and not common_unit(weights)[1]:
        notes.append(
            f"{light:,} of {len(weights):,} targets weigh less than {TIE:g} of all weight each: beside the others "
            "they cannot decide; bring the weights closer together"
        )
    prices = problem.prices[problem.allowed & (problem.prices > 0)]
    cheap = int(np.count_nonzero(prices < TIE * prices.max(initial=0.0)))
    if cheap:
        notes.append(
            f"{cheap:,} candidates cost less than {TIE:g} of the dearest: beside it their prices cannot decide; "
            "give all prices in the same currency"
        )
    return tuple(notes)
