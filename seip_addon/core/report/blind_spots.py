"""Parts of the road that no sensor sees, and how much of each named place is seen."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Boolean, Float, Integer
from ..results.site_file import PLACE, WEIGHTED, Area
from ..site.targets import Targets

DIRECTIONS = ("east", "north-east", "north", "north-west", "west", "south-west", "south", "south-east")
ARMS = DIRECTIONS[::2]


@dataclass(frozen=True, eq=False)
class BlindSpot:
    """A connected part of the road that no sensor sees.

    Parameters
    ----------
    targets : (n,) int64
        Indices of the targets in it.
    middle : (3,) float64, metres
        The one of these that is nearest to their mean, local.
    area : float, square metres
    where : str
        In words.
    """

    targets: Integer
    middle: Float
    area: float
    where: str


@dataclass(frozen=True)
class SeenPlace:
    """A named part of the road: its area in square metres, and the shares that one and two sensors or more see."""

    name: str
    area: float
    seen: float
    seen_twice: float


def blind_spots(targets: Targets, seen: Boolean, areas: Sequence[Area]) -> list[BlindSpot]:
    """Return the connected unseen parts of the road, the largest first.

    Targets are connected where their squares share a side.

    Parameters
    ----------
    seen : (t,) bool
    """
    unseen = np.flatnonzero(~seen)
    labels = _components(np.round((targets.xyz[unseen, :2] - targets.xyz[:, :2].min(axis=0)) / targets.spacing))
    spots = []
    for label in np.unique(labels):
        own = unseen[labels == label]
        places = targets.xyz[own]
        middle = places[np.argmin(np.hypot(*(places - places.mean(axis=0))[:, :2].T))]
        spots.append(BlindSpot(own, middle, len(own) * targets.spacing**2, _where(own, middle, targets, areas)))
    return sorted(spots, key=lambda spot: (-spot.area, *spot.middle.tolist()))


def seen_places(targets: Targets, seen_by: Integer, areas: Sequence[Area]) -> list[SeenPlace]:
    """Return what is seen of each named area; where no street is named, of the road towards each side as well."""
    parts = [(f"{area.name} (weighted)" if area.kind == WEIGHTED else area.name, area.within) for area in areas]
    if not any(area.kind == PLACE for area in areas):
        parts += _arms(targets)
    return [
        SeenPlace(
            name,
            float(within.sum() * targets.spacing**2),
            float((seen_by[within] > 0).mean()),
            float((seen_by[within] > 1).mean()),
        )
        for name, within in parts
        if within.any()
    ]


def _arms(targets: Targets) -> Iterator[tuple[str, Boolean]]:
    """Yield the targets on each side of the middle, those in weighted regions left out where there are any."""
    angle, _ = _from_middle(targets, targets.xyz)
    quarter = np.round(angle / (math.pi / 2)).astype(np.int64) % 4
    for number, name in enumerate(ARMS):
        yield f"Road to the {name} of the middle", (quarter == number) & ~targets.central


def _from_middle(targets: Targets, points: Float) -> tuple[Float, Float]:
    """Return direction (radians) and distance (metres) of points (n, 3) from the middle of all targets."""
    low, high = targets.xyz[:, :2].min(axis=0), targets.xyz[:, :2].max(axis=0)
    x, y = (points[:, :2] - (low + high) / 2).T
    return np.arctan2(y, x), np.hypot(x, y)


def _where(own: Integer, middle: Float, targets: Targets, areas: Sequence[Area]) -> str:
    """Say where a blind spot is: in the area that holds most of it, and in which direction from the middle."""
    angle, distance = _from_middle(targets, middle[None])
    direction = DIRECTIONS[round(float(angle[0]) / (math.pi / 4)) % 8]
    words = f"{distance[0]:.0f} m {direction} of the middle"
    held = [(int(area.within[own].sum()), area.name) for area in areas]
    most, name = max(held, key=lambda one: one[0], default=(0, ""))
    return f"{name}, {words}" if 2 * most >= len(own) else words


def _components(places: Float) -> Integer:
    """Return a number for each whole place (n, 2), the same for those that are joined by steps of one."""
    column, row = places.astype(np.int64).T
    width = int(row.max(initial=0)) + 2  # no row's end is beside another's beginning
    code = column * width + row
    order = np.argsort(code)
    labels = np.arange(len(code))
    ones, others = [], []
    for step in (1, width):
        at = np.searchsorted(code[order], code + step)
        found = np.flatnonzero((at < len(code)) & (code[order[np.minimum(at, len(code) - 1)]] == code + step))
        ones.append(found)
        others.append(order[at[found]])
    one, other = np.concatenate(ones), np.concatenate(others)
    while True:
        lower = np.minimum(labels[one], labels[other])
        new = labels.copy()
        np.minimum.at(new, one, lower)
        np.minimum.at(new, other, lower)
        new = new[new]
        if np.array_equal(new, labels):
            return labels
        labels = new
