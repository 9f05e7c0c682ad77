"""Colours of targets in the viewport: coverage, weight, comparison."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..arrays import Float, Integer
from .palette import SEEN_COLOURS, SEEN_TWICE, SEEN_WORDS

Aspect = Literal["seen", "times", "weights"]

THRICE_WORDS = ("not seen", "seen by one sensor", "seen by two", "seen by three or more")
THRICE_COLOURS = (*SEEN_COLOURS, "#123f66")
WEIGHT_COLOURS = ("#fff3d6", "#fdd07e", "#f0984a", "#c9592f", "#7f2d1f")
"""From the lightest weight to the heaviest; lightness alone tells them apart."""


@dataclass(frozen=True, eq=False)
class Colouring:
    """Classes of targets, each with its label and colour.

    Parameters
    ----------
    words : tuple of str
        Of each class, as a legend says them.
    colours : tuple of str
        Web colour of each class.
    of : (t,) int64
        The class of each target.
    """

    words: tuple[str, ...]
    colours: tuple[str, ...]
    of: Integer

    @property
    def shares(self) -> Float:
        """Share of the targets in each class, 0 to 1."""
        share: Float = np.bincount(self.of, minlength=len(self.words)) / max(len(self.of), 1)
        return share


def as_placed(seen_by: Integer) -> Colouring:
    """Colour targets as pictures of a placement do."""
    return Colouring(SEEN_WORDS, SEEN_COLOURS, np.minimum(seen_by, SEEN_TWICE))


def colouring(aspect: Aspect, seen_by: Integer, weight: Float) -> Colouring:
    """Colour targets by one aspect.

    Parameters
    ----------
    aspect : {"seen", "times", "weights"}
        Whether some sensor sees them, how many do, or how much they count.
    seen_by : (t,) int64
        How many sensors see each target.
    weight : (t,) float64
    """
    if aspect == "seen":
        return Colouring(("not seen", "seen"), (SEEN_COLOURS[0], SEEN_COLOURS[-1]), np.minimum(seen_by, 1))
    if aspect == "times":
        return Colouring(THRICE_WORDS, THRICE_COLOURS, np.minimum(seen_by, len(THRICE_WORDS) - 1))
    return _by_weight(weight)


def _by_weight(weight: Float) -> Colouring:
    """Give each weight a class, or where there are many, neighbouring ones one class: as many of them in each."""
    levels, of = np.unique(weight.round(6), return_inverse=True)
    groups = np.array_split(np.arange(len(levels)), min(len(levels), len(WEIGHT_COLOURS)))
    group_of = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
    ends = [(levels[group[0]], levels[group[-1]]) for group in groups]
    words = tuple(f"weight {low:g}" if low == high else f"weight {low:g} to {high:g}" for low, high in ends)
    spread = np.linspace(0, len(WEIGHT_COLOURS) - 1, max(len(groups), 2)).round().astype(int)
    return Colouring(words, tuple(WEIGHT_COLOURS[place] for place in spread[: len(groups)]), group_of[of.ravel()])
