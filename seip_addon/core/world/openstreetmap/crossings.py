"""Crossings of named streets in an extract, and those that a rule selects as the sites of a network."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Boolean, Float
from ...base.errors import SeipError
from ...geometry.tangent_plane import plan_metres
from ..opendrive.junctions import STREETS
from .extract import Extract, Tags
from .signals import SIGNAL_REACH
from .street_lanes import is_roundabout
from .streets import CLASSES, importance, is_street, joined

ONE_CROSSING = 60.0  # metres: nodes of the same streets within this distance are one crossing (dual carriageways)
CLASS_RULES = tuple(kind for kind in CLASSES if not kind.endswith("_link"))
RULES = ("all", "signals", "roundabouts", *CLASS_RULES)
"""Rules: all junctions of named streets, those with traffic signals, roundabouts, or those with a street of a class or
a higher one."""
ROUNDABOUT_REACH = 60.0  # metres from the centre of a roundabout to its carriageway at most
SAME_JUNCTION = 40.0  # metres: junctions closer than this are one site, named after the one with the most streets


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
    streets = [way for way in extract.ways.values() if is_street(way.tags)]
    round_ways = [way for way in streets if is_roundabout(way.tags)]
    ring_of = {node: number for number, ring in enumerate(joined(way.nodes for way in round_ways)) for node in ring}
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
    found = [
        Crossing(pair, float(group[:, 0].mean()), float(group[:, 1].mean()), importances[pair])
        for pair, there in places.items()
        for group in clustered(there, ONE_CROSSING)
    ]
    return tuple(sorted(found, key=lambda one: (one.streets, one.latitude, one.longitude)))


def clustered(places: Sequence[tuple[float, float]], distance: float) -> list[Float]:
    """Return latitudes and longitudes in groups (n, 2) that are more than a distance in metres apart, largest first."""
    points = shapely.points(plan_metres(places, places[0]))
    areas = shapely.get_parts(shapely.union_all(shapely.buffer(points, distance / 2)))
    of_group = [int(np.argmax(shapely.intersects(areas, point))) for point in points]
    groups = [np.array(places)[np.array(of_group) == group] for group in dict.fromkeys(of_group)]
    return sorted(groups, key=len, reverse=True)


def selected_junctions(
    extract: Extract, rules: Sequence[str], within: BaseGeometry | None = None
) -> tuple[Crossing, ...]:
    """Return the junctions of an extract that at least one rule selects, sorted by name and position.

    Junctions closer to each other than `SAME_JUNCTION` are one, as where carriageways are separate.

    Parameters
    ----------
    rules : sequence of str
        Some of `RULES`.
    within : shapely geometry, optional
        Area in longitude and latitude, degrees, outside which junctions are left out.

    Raises
    ------
    SeipError
        A rule is unknown, or no junction is selected.
    """
    unknown = next((rule for rule in rules if rule not in RULES), None)
    if unknown is not None:
        raise SeipError(f"unknown rule for junctions {unknown!r}: choose among {', '.join(RULES)}")
    found = [
        one
        for one in named_crossings(extract)
        if within is None or within.intersects(shapely.Point(one.longitude, one.latitude))
    ]
    if found:
        places = plan_metres([(one.latitude, one.longitude) for one in found], (found[0].latitude, found[0].longitude))
        selected = np.zeros(len(found), dtype=bool)
        for rule in rules:
            selected |= _selected(extract, rule, places, (found[0].latitude, found[0].longitude))
        found = _merged([one for one, kept in zip(found, selected.tolist(), strict=True) if kept])
    if not found:
        where = "in the given area" if within is not None else f"of {extract.name}"
        raise SeipError(
            f"no junction {where} is selected by {' '.join(rules)}: choose another rule ({', '.join(RULES[:3])} or a "
            "road class), another area, or another extract"
        )
    return tuple(found)


def _selected(extract: Extract, rule: str, places: Float, origin: tuple[float, float]) -> Boolean:
    """Return which places a rule selects, (n,) bool."""
    if rule == "all":
        return np.ones(len(places), dtype=bool)
    if rule == "signals":
        nodes = [node for node in extract.nodes.values() if node.tags.get("highway") == "traffic_signals"]
        reach = SIGNAL_REACH
    else:
        ways = [way for way in extract.ways.values() if is_street(way.tags)]
        nodes = [node for way in ways if _is_of(way.tags, rule) for node in extract.line(way)]
        reach = ROUNDABOUT_REACH if rule == "roundabouts" else SAME_JUNCTION / 2
    if not nodes:
        return np.zeros(len(places), dtype=bool)
    points = shapely.points(plan_metres([(node.latitude, node.longitude) for node in nodes], origin))
    near = shapely.STRtree(points).query(shapely.points(places), "dwithin", distance=reach)[0]
    selected: Boolean = np.isin(np.arange(len(places)), near)
    return selected


def _is_of(tags: Tags, rule: str) -> bool:
    if rule == "roundabouts":
        return is_roundabout(tags)
    highway = tags["highway"].removesuffix("_link")
    return highway in CLASS_RULES and CLASS_RULES.index(highway) <= CLASS_RULES.index(rule)


def _merged(found: Sequence[Crossing]) -> list[Crossing]:
    """Return the junctions without those that belong to a more important one nearby."""
    by_name = sorted(found, key=lambda one: (one.streets, one.latitude, one.longitude))
    order = sorted(by_name, key=lambda one: (-one.importance, -len(one.streets)))
    kept: list[Crossing] = []
    for one in order:
        here = (one.latitude, one.longitude)
        others = plan_metres([(other.latitude, other.longitude) for other in kept], here)
        if not len(others) or np.hypot(*others.T).min() > SAME_JUNCTION:
            kept.append(one)
    return sorted(kept, key=lambda one: (one.streets, one.latitude, one.longitude))
