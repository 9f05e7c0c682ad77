"""Parts of the road that no sensor sees, and how much of each named place is seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from matplotlib.colors import ListedColormap

from ...base.arrays import Boolean, Float, Integer
from ...site.locations import direction
from ...site.targets import Targets
from ..pictures.drawing import Style, add_axes, as_png, draw_callouts, draw_corners, new_page, window_around
from ..pictures.palette import INK, PAPER, SEEN_COLOURS
from ..results.placement_record import RecordedSensor
from ..results.site_file import PLACE, WEIGHTED, Area

MIN_DISTANCE = 0.5  # metres from a centre from which on there is a direction from it
DPI = 150
MAP_WIDTH = 7.2  # inches
MAP_SHAPES = (4.0 / MAP_WIDTH, 8.0 / MAP_WIDTH)  # least and largest height, in widths
MAP_MARGIN = 6.0  # metres around the road
NUMBER_SIZE = 10.0  # points


@dataclass(frozen=True, eq=False)
class BlindSpot:
    """A connected part of the road that no sensor sees: its targets (n,), area in square metres, and place in words.

    ``middle`` (3,) is the target that is nearest to their mean, local metres.
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
    """Return the connected unseen parts of the road, the largest first; squares that share a side are connected."""
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
    """Return what is seen of each named area, by the number of sensors that see each target; areas may overlap."""
    return [_seen(area.name, area.within, targets, seen_by) for area in areas if area.within.any()]


def seen_streets(targets: Targets, seen_by: Integer, areas: Sequence[Area]) -> list[SeenPlace]:
    """Return what is seen of each part of the road, and of all of it at the end.

    Each target belongs to one part: to the first weighted region that contains it, otherwise to the first street.
    Areas and shares therefore add up. ``areas`` are weighted regions and streets, without crossings.
    """
    streets = [(area.name, area.within) for area in areas if area.kind == PLACE]
    weighted = [(f"{area.name} (weighted)", area.within) for area in areas if area.kind == WEIGHTED]
    left = np.ones(len(targets), dtype=bool)
    parts = []
    for name, within in (*weighted, *streets, ("Other road", left.copy())):
        own, left = within & left, left & ~within
        if own.any():
            parts.append(_seen(name, own, targets, seen_by))
    return [*parts, _seen("Total", np.ones(len(targets), dtype=bool), targets, seen_by)]


def _seen(name: str, within: Boolean, targets: Targets, seen_by: Integer) -> SeenPlace:
    area = float(within.sum() * targets.spacing**2)
    return SeenPlace(name, area, float((seen_by[within] > 0).mean()), float((seen_by[within] > 1).mean()))


def centres(targets: Targets, areas: Sequence[Area]) -> list[tuple[str, Float]]:
    """Return the points (2,) from which places on the road are counted, with the names of what they are centres of.

    They are the centres of the weighted regions: that of a site that was built is its junction. Without a weighted
    region the centre is that of the road to be seen, the mean of its squares.
    """
    weighted = [area for area in areas if area.kind == WEIGHTED and area.within.any()]
    return [(area.name, targets.xyz[area.within, :2].mean(axis=0)) for area in weighted] or [
        ("the road", targets.xyz[:, :2].mean(axis=0))
    ]


def _where(own: Integer, middle: Float, targets: Targets, areas: Sequence[Area]) -> str:
    """Return where a blind spot is: the area that holds most of it, and distance and direction from a centre.

    A page names the only centre before its list of blind spots.
    """
    origins = centres(targets, areas)
    name, xy = min(origins, key=lambda centre: float(np.hypot(*(middle[:2] - centre[1]))))
    offset = middle[:2] - xy
    distance = float(np.hypot(*offset))
    away = f"{distance:.0f} m {direction(offset)} of" if distance >= MIN_DISTANCE else "at"
    words = f"{away} the centre" + (f" of {name}" if len(origins) > 1 else "")
    shares = [(int(area.within[own].sum()), area.name) for area in areas]
    most, name = max(shares, key=lambda one: one[0], default=(0, ""))
    if 2 * most < len(own):
        return words
    return f"{name if most == len(own) else f'mostly {name}'}, {words}"


def _components(places: Float) -> Integer:
    """Return a number for each whole place (n, 2), the same for those whose squares are joined by sides."""
    squares, of = np.unique(places, axis=0, return_inverse=True)
    parts = shapely.get_parts(shapely.coverage_union_all(shapely.box(*squares.T, *(squares + 1.0).T)))
    part, square = shapely.STRtree(shapely.points(squares + 0.5)).query(parts, predicate="contains")
    labels = np.empty(len(squares), dtype=np.int64)
    labels[square] = part
    return np.asarray(labels[of.ravel()])


def blind_spot_map(
    targets: Targets,
    seen_by: Integer,
    spots: Sequence[BlindSpot],
    placed: Sequence[RecordedSensor],
    attribution: Sequence[str],
) -> bytes:
    """Return the road by how many sensors see it, with the sensors and numbered blind spots, as PNG."""
    x, y = targets.xyz[:, 0], targets.xyz[:, 1]
    sensors = np.array([sensor.local_m[:2] for sensor in placed]).reshape(-1, 2)
    points = np.vstack((targets.xyz[:, :2], sensors))
    window = window_around((*points.min(axis=0).tolist(), *points.max(axis=0).tolist()), MAP_MARGIN, MAP_SHAPES)
    page = (MAP_WIDTH, MAP_WIDTH * (window[3] - window[1]) / (window[2] - window[0]))
    figure = new_page(page, DPI)
    axes = add_axes(figure, 0.0, 0.0, *page, window)

    column = np.round((x - x.min()) / targets.spacing).astype(np.int64)
    row = np.round((y - y.min()) / targets.spacing).astype(np.int64)
    cells = np.full((row.max() + 1, column.max() + 1), np.nan)
    cells[row, column] = np.minimum(seen_by, 2)
    half = targets.spacing / 2
    frame = (x.min() - half, x.max() + half, y.min() - half, y.max() + half)
    style: Style = {"cmap": ListedColormap(SEEN_COLOURS), "vmin": 0, "vmax": 2, "interpolation": "nearest"}
    axes.imshow(cells, origin="lower", extent=frame, aspect="auto", **style)
    axes.set(xlim=(window[0], window[2]), ylim=(window[1], window[3]))  # which the image has changed
    taken = draw_corners(axes, attribution)
    middles, inch = np.array([spot.middle[:2] for spot in spots]), (window[2] - window[0]) / MAP_WIDTH
    taken += [(*(middle - 0.12 * inch), *(middle + 0.12 * inch)) for middle in middles]
    axes.plot(*sensors.T, linestyle="none", marker="^", markersize=10, mfc=INK, mec=PAPER, mew=1.2, zorder=4.0)
    labels = [sensor.id for sensor in placed]
    draw_callouts(axes, sensors, labels, targets.xyz[:, :2], 3.0, taken)
    circle: Style = {"boxstyle": "circle,pad=0.22", "facecolor": PAPER, "edgecolor": INK, "linewidth": 1.2}
    style = {"ha": "center", "va": "center", "size": NUMBER_SIZE, "weight": "bold", "color": INK, "zorder": 5.0}
    for number, (right, up) in enumerate(_apart(middles, 0.24 * inch).tolist(), start=1):
        axes.text(right, up, str(number), bbox=circle, **style)
    return as_png(figure)


def _apart(points: Float, distance: float) -> Float:
    """Return points (n, 2) moved as little as a few steps allow until no two are nearer than a distance."""
    moved = points.copy()
    for _ in range(50):
        for number in range(1, len(moved)):
            away = moved[number] - moved[:number]
            gaps = np.hypot(*away.T)
            nearest = int(np.argmin(gaps))
            if gaps[nearest] < distance:
                way = away[nearest] / gaps[nearest] if gaps[nearest] > 0 else np.array((0.0, 1.0))
                moved[number] = moved[nearest] + distance * 1.02 * way
    return moved
