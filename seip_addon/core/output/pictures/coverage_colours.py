"""Colours of targets in pictures and in the viewport: returns, coverage, weight, comparison."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ...arrays import Float, Integer
from ...choosing.placement.deployment import Deployment
from ...choosing.placement.returns_summary import FEW_RETURNS
from ...errors import SeipError
from .palette import RETURNS_COLOURS, SEEN_COLOURS, SEEN_TWICE, SEEN_WORDS, WEIGHT_COLOURS

Numbers = NDArray[np.floating[Any]]
Aspect = Literal["returns", "seen", "times", "weights"]


@dataclass(frozen=True, eq=False)
class Legend:
    """Legend of the colours of targets.

    Parameters
    ----------
    title : str
    words : tuple of str
        Label of each class.
    colours : tuple of str
        Web colour of each class.
    shares : (k,) float64
        Share of the targets in each class, 0 to 1.
    """

    title: str
    words: tuple[str, ...]
    colours: tuple[str, ...]
    shares: Float


@dataclass(frozen=True, eq=False)
class Colouring:
    """Classes of targets, each with its label and colour.

    Parameters
    ----------
    words : tuple of str
        Name of each class in a legend.
    colours : tuple of str
        Web colour of each class.
    of : (t,) int64
        The class of each target.
    title : str
        Title of the legend.
    """

    words: tuple[str, ...]
    colours: tuple[str, ...]
    of: Integer
    title: str = "Road surface"

    @property
    def shares(self) -> Float:
        """Share of the targets in each class, 0 to 1."""
        share: Float = np.bincount(self.of, minlength=len(self.words)) / max(len(self.of), 1)
        return share


RETURNS_CLASSES = (1.0, FEW_RETURNS, 20.0)
"""Returns from a pedestrian at which the classes of a plan change."""


def of_placement(deployment: Deployment) -> Colouring:
    """Colour targets by what a placement was chosen for: returns from a pedestrian, or how many sensors see them."""
    returns = deployment.pedestrian_returns
    return as_placed(deployment.seen_by) if returns is None else by_returns(returns)


def by_returns(returns: Numbers) -> Colouring:
    """Colour targets by the expected returns from a pedestrian near each, (t,)."""
    ends = [f"{limit:g}" for limit in RETURNS_CLASSES]
    words = (f"below {ends[0]}", *(f"{low} to {high}" for low, high in pairwise(ends)), f"{ends[-1]} or more")
    of = np.searchsorted(RETURNS_CLASSES, returns, side="right")
    return Colouring(words, RETURNS_COLOURS, of, "Returns from a pedestrian on the road")


def as_placed(seen_by: Integer) -> Colouring:
    """Colour targets as pictures of a placement do."""
    return Colouring(SEEN_WORDS, SEEN_COLOURS, np.minimum(seen_by, SEEN_TWICE))


def colouring(aspect: Aspect, seen_by: Integer, weight: Float, returns: Numbers | None = None) -> Colouring:
    """Colour targets by one aspect.

    Parameters
    ----------
    aspect : {"returns", "seen", "times", "weights"}
        The returns from a pedestrian there, whether some sensor sees them, how many do, or how much they count.
    seen_by : (t,) int64
        How many sensors see each target.
    weight : (t,) float64
    returns : (t,) float64, optional
        Expected returns from a pedestrian near each target.

    Raises
    ------
    SeipError
        The aspect is returns, and there are none.
    """
    if aspect == "returns":
        if returns is None:
            raise SeipError("this placement was not chosen for returns from road users: choose another aspect")
        return by_returns(returns)
    if aspect == "seen":
        return Colouring(("not seen", "seen"), (SEEN_COLOURS[0], SEEN_COLOURS[-1]), np.minimum(seen_by, 1))
    if aspect == "times":
        return as_placed(seen_by)
    return _by_weight(weight)


def _by_weight(weight: Float) -> Colouring:
    """Group the weights into classes: one for each weight, or groups of neighbouring weights of equal size."""
    levels, of = np.unique(weight.round(6), return_inverse=True)
    groups = np.array_split(np.arange(len(levels)), min(len(levels), len(WEIGHT_COLOURS)))
    group_of = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
    ends = [(levels[group[0]], levels[group[-1]]) for group in groups]
    words = tuple(f"weight {low:g}" if low == high else f"weight {low:g} to {high:g}" for low, high in ends)
    spread = np.linspace(0, len(WEIGHT_COLOURS) - 1, max(len(groups), 2)).round().astype(int)
    colours = tuple(WEIGHT_COLOURS[place] for place in spread[: len(groups)])
    return Colouring(words, colours, group_of[of.ravel()], "Weight")
