"""Names of streets on a map that a user pans and zooms."""

import math
from dataclasses import dataclass

import numpy as np

from ...base.arrays import Float
from ...geometry.map_view import MapView
from ...world.street_plan import NamePlaces

MOST_LABELS = 60
MOST_TRIED = 600
ROOM = 1.1  # length of a street on the map, in lengths of its name, from which on it is named
REPEATED = 350.0  # pixels between two labels of one street at least
SPACE = 4.0  # pixels between labels


@dataclass(frozen=True)
class StreetLabel:
    """A name on the map, its middle in pixels, and its angle, radians counter-clockwise from -π/2 to π/2."""

    name: str
    middle: tuple[float, float]
    angle: float


def street_labels(places: NamePlaces, widths: Float, height: float, view: MapView, dots: Float) -> list[StreetLabel]:
    """Return labels that lie in the frame of a view without overlaps: main streets first, then by length.

    ``widths`` (k,) and ``height`` are those of the names, and ``dots`` (m, 3) have x, y and the radius of dots that no
    label may cover; all in pixels.
    """
    if not len(places.street):
        return []
    middles = view.to_pixels(places.positions)
    wide = widths[places.street]
    cosine, sine = np.abs(np.cos(places.angles)), np.abs(np.sin(places.angles))
    half = np.stack((wide * cosine + height * sine, wide * sine + height * cosine), axis=1) / 2.0
    left, bottom, right, top = view.frame
    inside = np.all((middles - half >= (left, bottom)) & (middles + half <= (right, top)), axis=1)
    fits = inside & (places.lengths * view.scale >= ROOM * wide)
    candidates = np.flatnonzero(fits)
    from_middle = np.linalg.norm(middles[candidates] - ((left + right) / 2.0, (bottom + top) / 2.0), axis=1)
    order = np.lexsort((from_middle, -places.lengths[candidates], -places.importance[candidates]))
    chosen: list[int] = []
    for one in candidates[order][:MOST_TRIED].tolist():
        others = np.array(chosen, dtype=np.int64)
        apart = np.abs(middles[others] - middles[one]) >= half[others] + half[one] + SPACE
        same = places.street[others] == places.street[one]
        near = np.linalg.norm(middles[others] - middles[one], axis=1) < REPEATED
        covers = _covers(middles[one], (float(wide[one]), height), float(places.angles[one]), dots)
        if apart.any(axis=1).all() and not (same & near).any() and not covers:
            chosen.append(one)
        if len(chosen) == MOST_LABELS:
            break
    names = [places.names[street] for street in places.street[chosen].tolist()] if chosen else []
    rows = zip(names, middles[chosen].tolist(), places.angles[chosen].tolist(), strict=True)
    return [StreetLabel(name, (x, y), angle) for name, (x, y), angle in rows]


def _covers(middle: Float, size: tuple[float, float], angle: float, dots: Float) -> bool:
    """Return whether a turned box covers part of a dot."""
    cosine, sine = math.cos(angle), math.sin(angle)
    from_middle = (dots[:, :2] - middle) @ np.array(((cosine, -sine), (sine, cosine)))
    beyond = np.maximum(np.abs(from_middle) - np.array(size) / 2.0, 0.0)
    return bool((np.linalg.norm(beyond, axis=1) < dots[:, 2]).any())


def start_of(label: StreetLabel, width: float, height: float) -> tuple[float, float]:
    """Return the pixel at which a label's first letter starts on its base line."""
    cosine, sine = math.cos(label.angle), math.sin(label.angle)
    back, down = width / 2.0, height / 2.0
    return label.middle[0] - back * cosine + down * sine, label.middle[1] - back * sine - down * cosine
