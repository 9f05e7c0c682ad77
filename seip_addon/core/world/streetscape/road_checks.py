"""Checks of the carriageways of a site: implausible grades, and steps between connected lanes."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import shapely

from ...base.arrays import Float
from ..opendrive.lanes import LaneSurface
from ..opendrive.road_map import RoadLink, RoadMap
from .road_surface import CARRIAGEWAY, by_road, in_groups

MAX_GRADE = 0.12  # grade of a carriageway above which a warning is given
GRADE_LENGTH, GRADE_STEPS = 2.0, (1, 5)
"""Step along a lane (metres), and numbers of steps over which its grade is measured."""
MIN_RISE = 0.02  # metres: a rise above that of `MAX_GRADE` by less than this is rounding
MAX_GAP = 0.1  # metres of height between the ends of two connected lanes
SAME_END = 0.3  # metres in plan between the ends of two connected lanes at most
MAX_NAMED = 3  # places in a message at most


def road_warnings(
    road_map: RoadMap, lanes: Sequence[LaneSurface], names: Mapping[str, str], origin: Float, unnamed: str = ""
) -> tuple[str, ...]:
    """Return warnings of steep carriageways and of steps between connected lanes, one sentence each.

    Parameters
    ----------
    lanes : sequence of LaneSurface
        Lanes of a scene on all levels, local axes.
    names : mapping of str to str
        Names of the streets by the ids of their roads.
    origin : (3,) float64, metres
        Map coordinates of the local origin.
    unnamed : str
        Name of roads without one; empty for their ids, which mean nothing in a map made of an extract.
    """
    driven = in_groups(lanes, CARRIAGEWAY)
    called = {road.id: names.get(road.id) or unnamed or f"road {road.id}" for road in road_map.roads}
    steep = _worst(steep_places(driven), called, origin, "up to {:.1%} ")
    gaps = _worst(height_gaps(road_map, driven), called, origin, "{:.2f} m ")
    messages = []
    if steep:
        messages.append(
            f"carriageways are steeper than {MAX_GRADE:.0%}: {steep}; check the heights of the map there before "
            "sensors are placed"
        )
    if gaps:
        messages.append(
            f"lanes that lead into each other differ in height by {gaps}; check the heights of the map there before "
            "sensors are placed"
        )
    return tuple(messages)


def steep_places(lanes: Sequence[LaneSurface]) -> Iterator[tuple[float, str, Float]]:
    """Yield grade, road and place (2,) of the steepest part of each lane with a grade above `MAX_GRADE`."""
    for lane in lanes:
        middle = (lane.left + lane.right) / 2
        away = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(middle[:, :2], axis=0).T))])
        if away[-1] <= 0.0:
            continue
        along = np.linspace(0.0, away[-1], max(int(away[-1] / GRADE_LENGTH), 1) + 1)
        height = np.interp(along, away, middle[:, 2])
        # Over a single step, rounded heights hide a grade just above the limit; over several, a short ramp is missed.
        grades = [(0.0, 0.0)]
        for steps in GRADE_STEPS:
            rise = np.abs(height[steps:] - height[:-steps])
            steep = np.flatnonzero(rise > MAX_GRADE * along[steps : steps + 1] + MIN_RISE)
            grades += [(float(rise[index] / along[steps]), float(along[index])) for index in steep]
        steepest, at = max(grades)
        if steepest > 0.0:
            place = [np.interp(at, away, middle[:, axis]) for axis in (0, 1)]
            yield steepest, lane.road_id, np.array(place)


def height_gaps(road_map: RoadMap, lanes: Sequence[LaneSurface]) -> Iterator[tuple[float, str, Float]]:
    """Yield height, road and place (2,) of each step between lanes of roads that lead into each other."""
    own = by_road(lanes)
    length = {road.id: road.length for road in road_map.roads}
    for road in road_map.roads:
        for link, contact in ((road.predecessor, "start"), (road.successor, "end")):
            if link is None or link.kind != "road" or road.id not in own or link.id not in own:
                continue
            ends = _ends(own[road.id], RoadLink("road", road.id, contact), length)
            others = _ends(own[link.id], link, length)
            if len(ends) and len(others):
                yield from ((gap, road.id, place) for gap, place in _steps(ends, others))


def _ends(lanes: Sequence[LaneSurface], at: RoadLink, length: Mapping[str, float]) -> Float:
    """Return the left and right corners (n, 2, 3) of the lanes that reach the start or end of their road."""
    s, row = (length[at.id], -1) if at.contact == "end" else (0.0, 0)
    reaching = [lane for lane in lanes if abs(float(lane.s[row]) - s) < SAME_END]
    return np.array([(lane.left[row], lane.right[row]) for lane in reaching]).reshape(-1, 2, 3)


def _steps(ends: Float, others: Float) -> Iterator[tuple[float, Float]]:
    """Yield height and place of the step at each lane end (n, 2, 3) that meets one of others (m, 2, 3)."""
    middles = shapely.points(others[:, :, :2].mean(axis=1))
    tree = shapely.STRtree(middles)
    for end in ends:
        middle = shapely.Point(end[:, :2].mean(axis=0))
        for other in others[tree.query(middle, predicate="dwithin", distance=SAME_END)]:
            # Roads may meet with opposite directions: left and right are paired as they lie nearer.
            swapped = np.hypot(*(end - other[::-1])[:, :2].T).sum() < np.hypot(*(end - other)[:, :2].T).sum()
            gap = float(np.abs(end[:, 2] - (other[::-1] if swapped else other)[:, 2]).max())
            if gap > MAX_GAP:
                yield gap, end[:, :2].mean(axis=0)


def _worst(places: Iterator[tuple[float, str, Float]], names: Mapping[str, str], origin: Float, figure: str) -> str:
    """Return the worst place of each street as a text, worst streets first."""
    found: dict[str, tuple[float, Float]] = {}
    for size, road, place in places:
        name = names[road]
        if size > found.get(name, (0.0, place))[0]:
            found[name] = (size, place)
    ordered = sorted(found.items(), key=lambda one: (-one[1][0], one[0]))
    texts = []
    for name, (size, place) in ordered[:MAX_NAMED]:
        x, y = (round(value) + 0 for value in (place + origin[:2]).tolist())
        texts.append(f"{figure.format(size)}on {name} at ({x}, {y})")
    more = len(ordered) - MAX_NAMED
    return ", ".join(texts) + (f", and on {more} more" if more > 0 else "")
