"""Names of the streets that meet at a place of an extract, and the place where named streets meet."""

import difflib
import itertools
import math
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence

import shapely

from ...base.errors import SeipError
from ..opendrive.lanes import LaneSurface
from ..opendrive.road_map import RoadMap
from ..streetscape.intersections import SAME_DIRECTION, TOUCH
from .crossings import clustered
from .extract import Extract, Way
from .streets import CLASSES, is_street, shown_name

MAX_JUNCTION_DISTANCE = 60.0  # metres from a requested place to its junction at most
NAMES = ("name", "name:en", "alt_name", "ref")
"""Tags that name a street."""
RANKS = (*(kind for kind in CLASSES if not kind.endswith("_link")), "service", *CLASSES)
"""Classes of streets, the highest first, and slip roads last."""


def ranks(ways: Iterable[Way]) -> defaultdict[str, int]:
    """Return the rank of each street by name: the rank of its highest class, with slip roads last."""
    ranks: defaultdict[str, int] = defaultdict(lambda: len(RANKS))
    for way in ways:
        name, kind = shown_name(way.tags), way.tags.get("highway", "")
        ranks[name] = min(ranks[name], RANKS.index(kind) if kind in RANKS else len(RANKS))
    return ranks


def headings_at(
    road_map: RoadMap, lanes: Sequence[LaneSurface], junctions: Collection[str]
) -> defaultdict[str, list[float]]:
    """Return the directions (radians) of each street at a group of junctions, by street name."""
    area = shapely.union_all([lane.polygon for lane in lanes if lane.junction_id in junctions])
    headings: defaultdict[str, list[float]] = defaultdict(list)
    for lane in lanes:
        if lane.junction_id is None and area.distance(lane.polygon) < TOUCH:
            x, y = (lane.left[-1] - lane.left[0])[:2].tolist()
            headings[road_map.names[lane.road_id]].append(math.atan2(y, x))
    return headings


def crossing_pair(names: Sequence[str], headings: Mapping[str, Sequence[float]]) -> list[str]:
    """Return the first name, and the first other name whose street crosses that one instead of continuing it."""

    def crosses(name: str) -> bool:
        pairs = itertools.product(headings.get(names[0], ()), headings.get(name, ()))
        # Directions are compared modulo 180 degrees: a street that continues the other under a new name is in line with
        # it.
        return any(abs(math.remainder(one - other, math.pi)) > SAME_DIRECTION for one, other in pairs)

    # The sort is stable, so that names keep their rank among those that cross, and among those that do not.
    others = sorted(names[1:], key=lambda name: not crosses(name))
    return [*names[:1], *others[:1]]


def spelt(extract: Extract, name: str) -> str:
    """Return the name of a street in the spelling of the extract, from any of its names."""
    wanted = name.strip().casefold()
    for way in _streets_called(extract, name):
        key = next(key for key in NAMES if way.tags.get(key, "").casefold() == wanted)
        return shown_name(way.tags) if key == "name" else way.tags[key]
    return name.strip()


def meeting_place(extract: Extract, names: tuple[str, ...]) -> tuple[tuple[float, float], tuple[str, ...]]:
    """Return the latitude and longitude where streets meet, and a note if they meet in several places.

    Nodes that the streets share are grouped by distance; the result is the mean of the largest group.
    """
    named = {name: _streets_called(extract, name) for name in names}
    for name, ways in named.items():
        if not ways:
            raise SeipError(f"{extract.name} has no street called {name!r}; {_similar_names(extract, name)}")
    nodes = [{number for way in ways for number in way.nodes} for ways in named.values()]
    shared = sorted(set.intersection(*nodes) & extract.nodes.keys())
    if not shared:
        both = " and ".join(map(repr, names))
        raise SeipError(f"{both} do not meet in {extract.name}: name streets that share a node")
    # Dual carriageways that cross share up to four nodes, which are one place.
    nodes_there = [(extract.nodes[number].latitude, extract.nodes[number].longitude) for number in shared]
    places = [group.mean(axis=0).tolist() for group in clustered(nodes_there, MAX_JUNCTION_DISTANCE)]
    place = (places[0][0], places[0][1])
    if len(places) == 1:
        return place, ()
    first, *others = [f"{latitude:.5f} {longitude:.5f}" for latitude, longitude in places[:4]]
    note = (
        f"{' and '.join(names)} meet in {len(places)} places; the one at {first} is used: for a different one give "
        f"--near-latlon {' or '.join(others)}"
    )
    return place, (note,)


def _streets_called(extract: Extract, name: str) -> list[Way]:
    wanted = name.strip().casefold()
    return [
        way
        for way in extract.ways.values()
        if is_street(way.tags, service=True) and wanted in {way.tags.get(key, "").casefold() for key in NAMES}
    ]


def _similar_names(extract: Extract, name: str) -> str:
    known = sorted({way.tags["name"] for way in extract.ways.values() if "name" in way.tags and is_street(way.tags)})
    close = difflib.get_close_matches(name, known, n=4, cutoff=0.4) or known[:5]
    return f"the closest: {', '.join(close)}" if close else "its streets have no names"
