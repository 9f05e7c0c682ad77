"""Grade-separated crossings of an extract: streets on bridges and in underpasses, with the clearance required."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from .extract import Extract, Tags, Way
from .quantities import metres
from .street_lanes import lane_widths

DECK = 1.0
"""Thickness (metres) of a bridge's deck, with its bearings."""
HEADROOMS = {
    **dict.fromkeys(("rail", "light_rail", "subway", "narrow_gauge"), 5.5),
    **dict.fromkeys(("footway", "path", "cycleway", "pedestrian", "steps", "bridleway", "corridor"), 2.5),
}
"""Clear height (metres) above ways that are not roads; roads and trams have `ROAD_HEADROOM`."""
ROAD_HEADROOM = 4.5
MAX_LAYER = 5
KERBSIDE, NARROW = 2.0, 4.0  # metres: the strip next to the lanes of a road, a way that is not a road
_SHARED = 0.5  # metres around a node of both ways within which they meet, not cross
_NO_ROAD = {"construction", "proposed", "abandoned", "razed", "platform", "elevator", "services", "rest_area"}


@dataclass(frozen=True, eq=False)
class Crossing:
    """Crossing of a street on a bridge, or in an underpass, with another way.

    Parameters
    ----------
    street : int
        Id of the street that is raised or lowered, as written for netconvert.
    way, other : Way
        That street, and the way that it crosses.
    layers : (int, int)
        Layers of both.
    rise : float, metres
        Height of the upper road above the lower one.
    """

    street: int
    way: Way
    other: Way
    layers: tuple[int, int]
    rise: float

    @property
    def is_bridge(self) -> bool:
        """Whether the street is the upper of the two ways."""
        return self.layers[0] > self.layers[1]

    def __str__(self) -> str:
        link = "over" if self.is_bridge else "under"
        return f"{_called(self.way.tags)} {link} {_called(self.other.tags)}"


@dataclass(frozen=True, eq=False)
class Structures:
    """The grade-separated streets of an extract.

    Parameters
    ----------
    crossings : tuple of Crossing
        Crossings of streets with ways on a different layer.
    bridges : frozenset of int
        Ids of all streets on bridges, including those that cross no way of the extract.
    ends : frozenset of int
        Nodes at the ends of the streets that are raised or lowered.
    """

    crossings: tuple[Crossing, ...]
    bridges: frozenset[int]
    ends: frozenset[int]

    @property
    def layers(self) -> Mapping[int, int]:
        """Layer of each street that is raised or lowered."""
        return {one.street: one.layers[0] for one in self.crossings}

    @property
    def apart(self) -> frozenset[int]:
        """Ids of the streets that do not follow the ground."""
        return self.bridges | self.layers.keys()


def layer(tags: Tags) -> int:
    """Return the layer of a way: 0 on the ground, positive on bridges, negative below."""
    if tags.get("tunnel") == "building_passage":
        return 0
    on_bridge = is_bridge(tags)
    try:
        given = int(tags.get("layer", ""))
    except ValueError:
        given = 0
    given = min(max(given, -MAX_LAYER), MAX_LAYER)
    return max(given, 1) if on_bridge else given


def is_bridge(tags: Tags) -> bool:
    """Return whether a way lies on a bridge."""
    return tags.get("bridge", "no") != "no"


def structures(extract: Extract, streets: Sequence[tuple[int, Way]], lines: Mapping[int, Float]) -> Structures:
    """Return the grade-separated crossings of streets with each other, with railways and with paths.

    A street on a layer other than 0 has a crossing where it passes a way of a different layer without a common node.
    Bridges over water are not crossings: water is below the ground already, and they need no extra height.

    Parameters
    ----------
    streets : sequence of (id, Way)
        Streets as they are written for netconvert.
    lines : mapping of int to (n, 2) float64, metres
        Positions of the nodes by id.
    """
    # Streets are pieces of ways of the extract and share their tags objects, so that the identity of the tags finds the
    # whole ways that the pieces stand for. Railways and paths, which are not written, are added as ways to be crossed.
    own = {id(way.tags) for _, way in streets}
    ways = [way for _, way in streets]
    ways += [way for way in extract.ways.values() if id(way.tags) not in own and _headroom(way.tags) is not None]
    plans = [np.array([lines[node] for node in way.nodes if node in lines]).reshape(-1, 2) for way in ways]
    levels = [layer(way.tags) for way in ways]
    paths = [shapely.LineString(plan if len(plan) > 1 else None) for plan in plans]
    tree = shapely.STRtree(paths)
    moved = [index for index in range(len(streets)) if levels[index] != 0]
    found = []
    for index in moved:
        for near in sorted(tree.query(paths[index], predicate="intersects").tolist()):
            pair = (levels[index], levels[near])
            if not _moves(*pair) or _where(plans[index], plans[near]).is_empty:
                continue
            # The clearance is that of the lower way, whichever of the two it is.
            below = ways[near] if pair[0] > pair[1] else ways[index]
            rise = (_headroom(below.tags) or ROAD_HEADROOM) + DECK
            found.append(Crossing(streets[index][0], ways[index], ways[near], pair, rise))
    ends = frozenset(node for one in found for node in (one.way.nodes[0], one.way.nodes[-1]))
    bridges = frozenset(number for number, way in streets if is_bridge(way.tags) and layer(way.tags) > 0)
    return Structures(tuple(found), bridges, ends)


def _moves(own: int, other: int) -> bool:
    """Return whether a street on layer `own` leaves the ground because of a way on layer `other`."""
    # Exactly one of two ways on different layers is moved: the upper one if it is above the ground, otherwise the lower
    # one. Each crossing is therefore found once.
    return own > max(other, 0) or own < other <= 0


def _headroom(tags: Tags) -> float | None:
    """Return the clear height (metres) above a way, None for ways over which a bridge needs no extra height."""
    if tags.get("tunnel", "no") not in ("no", "building_passage") or tags.get("area") == "yes":
        return None
    railway, highway = tags.get("railway"), tags.get("highway")
    if railway == "tram":
        return ROAD_HEADROOM
    if railway in HEADROOMS:
        return None if tags.get("cutting", "no") != "no" else HEADROOMS[railway]
    if highway is None or highway in _NO_ROAD:
        return None
    return HEADROOMS.get(highway, ROAD_HEADROOM)


def half_width(tags: Tags) -> float:
    """Return half the width of a way, metres: for a road that of its lanes, with a strip next to them."""
    if tags.get("highway") is None or tags["highway"] in HEADROOMS:
        return (metres(tags.get("width"), 60.0) or NARROW) / 2
    return sum(itertools.chain(*lane_widths(tags).values())) / 2 + KERBSIDE


def _where(line: Float, other: Float) -> BaseGeometry:
    """Return the intersection of two lines (n, 2) in plan, without the surroundings of nodes that both share."""
    common = shapely.LineString(line).intersection(shapely.LineString(other))
    shared = sorted(set(map(tuple, line.tolist())) & set(map(tuple, other.tolist())))
    return common.difference(shapely.multipoints(np.array(shared)).buffer(_SHARED)) if shared else common


def _called(tags: Tags) -> str:
    """Return the name of a way in messages."""
    name = tags.get("name") or tags.get("ref")
    if name:
        return name
    kind = tags.get("highway") or tags.get("railway") or "way"
    known = {"rail": "a railway", "tram": "a tram", "light_rail": "a light railway", "subway": "a railway"}
    return known.get(kind, f"a street ({kind})" if kind not in HEADROOMS else f"a {kind}")


def corridors(crossing: Crossing, street: Float, other: Float) -> Iterator[tuple[BaseGeometry, BaseGeometry]]:
    """Yield the areas in plan of both ways around each place where they cross.

    Parameters
    ----------
    street, other : (n, 2) float64, metres
        Lines of the two ways.
    """
    halves = [half_width(way.tags) for way in (crossing.way, crossing.other)]
    lines = [shapely.LineString(line) for line in (street, other)]
    areas = [line.buffer(half, cap_style="flat") for line, half in zip(lines, halves, strict=True)]
    common = _where(street, other)
    # Two ways may cross several times. Parts of the overlap without an intersection of the lines are places where wide
    # ways only run close to each other.
    for place in shapely.get_parts(areas[0].intersection(areas[1])):
        if place.intersects(common):
            near = place.buffer(sum(halves))
            yield areas[0].intersection(near), areas[1].intersection(near)
