"""Junctions of a map: area, and search by id, name, streets or position."""

import difflib
from collections.abc import Iterable

import numpy as np
import shapely
from shapely import Point
from shapely.geometry.base import BaseGeometry

from ...base.errors import SeipError
from ...geometry.plan import closed
from .lanes import LaneSurface
from .road_map import Junction, RoadMap

STREETS = " / "
"""Separator between the names of streets that meet at a junction."""
_MAX_GAP = 0.005  # metres
_MAX_END_DISTANCE = 0.5  # metres from a junction to the end of a lane that leads to it


def junction_area(surfaces: Iterable[LaneSurface], junction_id: str) -> BaseGeometry:
    """Return the union of all lanes of a junction in plan, map coordinates; empty if it has none."""
    lanes = [surface.polygon for surface in surfaces if surface.junction_id == junction_id]
    # Neighbouring lanes of different roads meet to within rounding: hairline cracks are closed.
    return closed(shapely.union_all(lanes), _MAX_GAP)


def find_junction(road_map: RoadMap, surfaces: Iterable[LaneSurface], id_or_name: str) -> Junction:
    """Return the junction with an id or, if there is none, the only one with a name or where given streets meet.

    Streets are given as ``High Street / Mill Lane``; if they meet at several junctions, the first one is returned.

    Parameters
    ----------
    road_map : RoadMap
        Map to search.
    surfaces : iterable of LaneSurface
        Lanes of the map; a junction without lanes cannot be studied.
    id_or_name : str
        Id, name or streets of the junction.

    Raises
    ------
    SeipError
        There is no such junction (close ones are named), the name is not unique, or the junction has no lanes.
    """
    surfaces = tuple(surfaces)
    of_id = [junction for junction in road_map.junctions if junction.id == id_or_name]
    found = of_id or [junction for junction in road_map.junctions if junction.name == id_or_name]
    found = found or _by_streets(road_map, surfaces, id_or_name)[:1]
    if not found:
        raise SeipError(f"no junction {id_or_name!r} in map {road_map.name!r}; {_close(road_map, id_or_name)}")
    if len(found) > 1:
        ids = ", ".join(junction.id for junction in found)
        raise SeipError(f"several junctions are called {id_or_name!r}; choose one by its id: {ids}")
    if not any(surface.junction_id == found[0].id for surface in surfaces):
        raise _no_lanes(road_map, found[0], id_or_name)
    return found[0]


def _no_lanes(road_map: RoadMap, junction: Junction, called: str) -> SeipError:
    """Return the error of a junction without lanes, with the place where its roads meet if it may have none."""
    ends = [
        road.frame(np.array([s])).origin[0]
        for road in road_map.roads
        for link, s in ((road.predecessor, 0.0), (road.successor, road.length))
        if link is not None and (link.kind, link.id) == ("junction", junction.id)
    ]
    if not junction.kind or not ends:
        return SeipError(f"junction {called!r} has no lanes; choose another junction or a place on the map")
    x, y, _ = np.mean(ends, axis=0)
    return SeipError(
        f"junction {called!r} is a {junction.kind} one, which has no lanes of its own: give the place where its roads "
        f"meet, --near {x:.0f} {y:.0f}"
    )


def streets_of_junctions(road_map: RoadMap, surfaces: Iterable[LaneSurface]) -> dict[str, tuple[str, ...]]:
    """Return the names of the streets that meet at each junction, by its id, in the order of the file."""
    areas: dict[str, list[BaseGeometry]] = {}
    ends, of_end = [], []
    for surface in surfaces:
        if surface.junction_id is not None:
            areas.setdefault(surface.junction_id, []).append(surface.polygon)
        elif name := road_map.names.get(surface.road_id, ""):
            for row in (0, -1):
                ends.append(Point((surface.left[row, :2] + surface.right[row, :2]) / 2))
                of_end.append(name)
    tree = shapely.STRtree(ends)
    found = {}
    for number, parts in areas.items():
        touching = tree.query(shapely.union_all(parts), predicate="dwithin", distance=_MAX_END_DISTANCE)
        found[number] = tuple(dict.fromkeys(of_end[index] for index in sorted(touching.tolist())))
    return found


def _by_streets(road_map: RoadMap, surfaces: Iterable[LaneSurface], name: str) -> list[Junction]:
    """Return the junctions at which all the streets of a name such as ``High Street / Mill Lane`` meet."""
    wanted = [part.strip().casefold() for part in name.split(STREETS) if part.strip()]
    if len(wanted) < 2:
        return []
    meeting = streets_of_junctions(road_map, surfaces)
    there = {number: {street.casefold() for street in streets} for number, streets in meeting.items()}
    return [junction for junction in road_map.junctions if there.get(junction.id, set()).issuperset(wanted)]


def nearest_junctions(
    road_map: RoadMap, surfaces: Iterable[LaneSurface], x: float, y: float, k: int
) -> tuple[tuple[Junction, float], ...]:
    """Return the ``k`` junctions nearest to a place in map coordinates, and their distances in metres."""
    place = Point(x, y)
    distances: dict[str, float] = {}
    for surface in surfaces:
        if surface.junction_id is not None:
            nearest = distances.get(surface.junction_id, float("inf"))
            distances[surface.junction_id] = min(nearest, float(surface.polygon.distance(place)))
    found = [(junction, distances[junction.id]) for junction in road_map.junctions if junction.id in distances]
    return tuple(sorted(found, key=lambda pair: pair[1])[:k])


def _close(road_map: RoadMap, name: str) -> str:
    known = [text for junction in road_map.junctions for text in (junction.id, junction.name) if text]
    if not known:
        return "the map has no junctions, choose a place by its coordinates"
    close = difflib.get_close_matches(name, known, n=5, cutoff=0.4) or known[:5]
    return f"the closest: {', '.join(dict.fromkeys(close))}"
