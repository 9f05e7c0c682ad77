"""Crossings of named streets in an extract."""

import math
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass

from ..opendrive.junctions import STREETS
from .extract import Extract, rings
from .street_lanes import is_roundabout
from .streets import importance, is_street

ONE_CROSSING = 60.0  # metres: nodes of the same streets within this distance are one crossing (dual carriageways)
EARTH_RADIUS = 6_371_000.0  # metres


@dataclass(frozen=True)
class Crossing:
    """A place where streets of different names meet.

    Parameters
    ----------
    streets : tuple of str
        Names of the streets, in alphabetical order.
    latitude, longitude : float, degrees
    importance : int
        Importance of the second most important of its named streets, see `streets.importance`: at a crossing of a
        main street with a residential one it is that of the latter.
    """

    streets: tuple[str, ...]
    latitude: float
    longitude: float
    importance: int = 0

    @property
    def name(self) -> str:
        """Names of the streets in the form that `junctions.find_junction` accepts."""
        return STREETS.join(self.streets)


def named_crossings(extract: Extract) -> tuple[Crossing, ...]:
    """Return the crossings of an extract's named streets, sorted by name; a roundabout is one crossing."""
    streets = [way for way in extract.ways.values() if "highway" in way.tags and is_street(way.tags)]
    round_ways = [way for way in streets if is_roundabout(way.tags)]
    ring_of = {node: number for number, ring in enumerate(rings(round_ways)[0]) for node in ring}
    names: defaultdict[tuple[str, int], dict[str, int]] = defaultdict(dict)  # importance of each street of a place
    nodes: defaultdict[tuple[str, int], set[int]] = defaultdict(set)
    for way in streets:
        for node in way.nodes:
            if node in extract.nodes:
                place = ("ring", ring_of[node]) if node in ring_of else ("node", node)
                nodes[place].add(node)
                if "name" in way.tags:
                    name = way.tags["name"]
                    names[place][name] = max(importance(way.tags), names[place].get(name, 0))
    places: defaultdict[tuple[str, ...], list[tuple[float, float]]] = defaultdict(list)
    importances: defaultdict[tuple[str, ...], int] = defaultdict(int)
    for place, streets_there in names.items():
        if len(streets_there) > 1:
            there = [extract.nodes[node] for node in sorted(nodes[place])]
            middle = (sum(n.latitude for n in there) / len(there), sum(n.longitude for n in there) / len(there))
            pair = tuple(sorted(streets_there))
            places[pair].append(middle)
            importances[pair] = max(importances[pair], sorted(streets_there.values())[-2])
    found = [Crossing(pair, *middle, importances[pair]) for pair, there in places.items() for middle in _apart(there)]
    return tuple(sorted(found, key=lambda one: (one.streets, one.latitude, one.longitude)))


def _apart(places: list[tuple[float, float]]) -> Iterator[tuple[float, float]]:
    """Yield the centres of groups of places that lie close to each other."""
    waiting = sorted(places)
    while waiting:
        group = [place for place in waiting if _metres(waiting[0], place) <= ONE_CROSSING]
        waiting = [place for place in waiting if place not in group]
        yield sum(place[0] for place in group) / len(group), sum(place[1] for place in group) / len(group)


def _metres(one: tuple[float, float], other: tuple[float, float]) -> float:
    """Return the distance between two places near each other (latitude, longitude), metres."""
    north = math.radians(other[0] - one[0])
    east = math.radians(other[1] - one[1]) * math.cos(math.radians(one[0]))
    return EARTH_RADIUS * math.hypot(north, east)
