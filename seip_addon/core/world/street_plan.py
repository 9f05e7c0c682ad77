"""Plan of the streets of a map, on which a user chooses a junction."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ..arrays import Float, Integer

LABEL_SPACING = 150.0  # metres between places along a street at which its name may stand
CHORD = 30.0  # metres to each side of such a place that its direction is taken from


@dataclass(frozen=True, eq=False)
class PlanStreet:
    """A street, or a piece of one.

    Parameters
    ----------
    line : (n, 2) float64, metres
        Centre line.
    importance : int
        2 for a main street, 1 for a larger one, otherwise 0.
    """

    line: Float
    importance: int


@dataclass(frozen=True, eq=False)
class NamePlaces:
    """Places along streets at which their names may stand.

    Parameters
    ----------
    names : tuple of str
        Names of the streets, in alphabetical order.
    street : (n,) int64
        Street of each place, an index into ``names``.
    positions : (n, 2) float64, metres
    angles : (n,) float64, radians
        Direction of the street, counter-clockwise from east, from -π/2 to π/2.
    lengths : (n,) float64, metres
        Length of the unbranched piece of the street.
    importance : (n,) int64
        2 for a main street, 1 for a larger one, otherwise 0.
    """

    names: tuple[str, ...]
    street: Integer
    positions: Float
    angles: Float
    lengths: Float
    importance: Integer


@dataclass(frozen=True, eq=False)
class StreetPlan:
    """The streets of a map in plan: x east and y north, in metres from a place in their middle.

    Parameters
    ----------
    streets : tuple of PlanStreet
    junctions : (n, 2) float64, metres
        Junctions, or crossings of named streets.
    importance : (n,) int64
        Importance of each, from 0 to 2.
    names : NamePlaces
    attribution : str
        Credit required by the data; may be empty.
    """

    streets: tuple[PlanStreet, ...]
    junctions: Float
    importance: Integer
    names: NamePlaces
    attribution: str


def name_places(named: Mapping[str, Sequence[PlanStreet]]) -> NamePlaces:
    """Return places for the names of streets; pieces that continue each other are one."""
    names = tuple(sorted(named))
    rows = [(number, *place) for number, name in enumerate(names) for place in _places_along(named[name])]
    table = np.array(rows, dtype=np.float64).reshape(-1, 6)
    return NamePlaces(
        names, table[:, 0].astype(np.int64), table[:, 1:3], table[:, 3], table[:, 4], table[:, 5].astype(np.int64)
    )


def _places_along(pieces: Sequence[PlanStreet]) -> Iterator[tuple[float, float, float, float, int]]:
    """Yield x, y, angle, length and importance for places along the pieces of one street."""
    most = max(one.importance for one in pieces)
    merged = shapely.line_merge(shapely.multilinestrings([shapely.linestrings(one.line) for one in pieces]))
    for line in shapely.get_parts(merged):
        length = float(line.length)
        if length <= 0.0:
            continue
        count = max(1, round(length / LABEL_SPACING))
        along = (np.arange(count) + 0.5) * (length / count)
        here, before, after = (
            shapely.get_coordinates(shapely.line_interpolate_point(line, np.clip(along + step, 0.0, length)))
            for step in (0.0, -CHORD, CHORD)
        )
        east, north = (after - before).T
        upside_down = (east < 0.0) | ((east == 0.0) & (north < 0.0))
        angles = np.arctan2(np.where(upside_down, -north, north), np.abs(east))
        for (x, y), angle in zip(here.tolist(), angles.tolist(), strict=True):
            yield x, y, angle, length, most
