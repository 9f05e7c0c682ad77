"""Streets of an extract for SUMO's netconvert: selection of ways, with explicit lanes, widths and pavements.

Its use is shown in `tests/core/world/openstreetmap/test_streets.py`.
"""

import itertools
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import shapely

from ...base.arrays import Float
from .bridges import Structures, structures
from .extract import Extract, Node, Tags, Way, reversed_tags
from .handedness import drives_on_the_left
from .signals import Signals, matched_signals
from .street_lanes import (
    CYCLE_LANE_WIDTH,
    DIRECTIONS,
    SIDEWALK_WIDTH,
    cycle_lane,
    has_contraflow,
    has_lane_count,
    implausible_lanes,
    is_one_way,
    is_roundabout,
    lane_counts,
    lane_widths,
)

CLASSES = (
    *("motorway", "trunk", "primary", "secondary", "tertiary"),
    *("motorway_link", "trunk_link", "primary_link", "secondary_link", "tertiary_link"),
    *("unclassified", "residential", "living_street", "road", "busway"),
)
"""Values of ``highway`` that are streets; ``service`` (driveways, aisles, alleys) is one on request."""
MAIN_CLASSES = {"motorway", "trunk", "primary", "secondary"}
TRACKS = {"tram", "light_rail"}
"""Values of ``railway`` whose tracks may lie in a street."""
PAVED_CLASSES = {"primary", "secondary", "tertiary", "unclassified", "residential", "living_street", "road"}
"""Classes of streets that have a pavement on both sides unless the map has tags for pavements."""
COPIED = (
    *("highway", "railway", "name", "oneway", "junction", "maxspeed"),
    *("turn:lanes", "turn:lanes:forward", "turn:lanes:backward", "access", "area"),
)
"""Tags of a street that netconvert reads as they are."""
_SIDES = {(True, True): "both", (True, False): "left", (False, True): "right", (False, False): "none"}
_FIRST_OTHER = "\u0900"  # from here on (Devanagari, Thai, Chinese …) the font of the pictures has no letters
MAX_MEDIAN = 35.0  # metres between the middles of two carriageways of one street
JOIN_DISTANCE = 20.0  # metres between nodes that are one junction
SHORT_PIECE = 30.0  # metres: a piece of a street that is shorter is no longer than a junction
MIN_ELEVATED = 0.8  # share of a street network's nodes that must have an elevation for it to be used


@dataclass(frozen=True)
class StreetFile:
    """Streets as written for netconvert.

    Parameters
    ----------
    elevated : bool
        Whether the nodes have elevations.
    left_hand : bool
        Whether traffic keeps to the left.
    roundabouts : tuple of frozenset of int
        Nodes of each roundabout; each node where a street meets it is a separate junction.
    slip_ends : tuple of int
        Nodes where a slip lane leaves or joins a street, more than `JOIN_DISTANCE` from any other junction node.
    ways : mapping of int to Way
        Streets by the id under which they are written.
    structures : Structures
        Streets on bridges and in underpasses.
    lone_signals : tuple of int
        Nodes of traffic signals without a junction within reach.
    widened : tuple of Way
        Short pieces of streets that have the lanes of their neighbours.
    notes : tuple of str
        Assumptions made, as messages.
    """

    elevated: bool
    left_hand: bool
    roundabouts: tuple[frozenset[int], ...]
    slip_ends: tuple[int, ...]
    ways: Mapping[int, Way]
    structures: Structures
    lone_signals: tuple[int, ...]
    widened: tuple[Way, ...]
    notes: tuple[str, ...]


def is_street(tags: Tags, *, service: bool = False) -> bool:
    """Return whether a way is a street on the surface; driveways on request."""
    highway = tags.get("highway")
    return _is_on_surface(tags) and (highway in CLASSES or (service and highway == "service"))


def is_track(tags: Tags) -> bool:
    """Return whether a way is a track of trams or light rail on the surface."""
    return _is_on_surface(tags) and tags.get("railway") in TRACKS


def importance(tags: Tags) -> int:
    """Return 2 for a main street (secondary and above, with its slip roads), 1 for a tertiary one, otherwise 0."""
    highway = tags.get("highway", "").removesuffix("_link")
    return 2 if highway in MAIN_CLASSES else int(highway == "tertiary")


def _is_on_surface(tags: Tags) -> bool:
    return tags.get("area") != "yes" and tags.get("tunnel", "no") in ("no", "building_passage")


def write_streets(
    extract: Extract,
    path: Path,
    window: tuple[float, float, float, float],
    *,
    service: bool = False,
    left_hand: bool | None = None,
) -> StreetFile:
    """Write the streets within a window as a separate extract for netconvert.

    Parameters
    ----------
    extract : Extract
        Extract to take the streets from.
    path : Path
        File to write (.osm).
    window : (4,) float, degrees
        South, west, north, east.
    service : bool
        Whether driveways, aisles and alleys (``highway=service``) are streets.
    left_hand : bool, optional
        Whether traffic keeps to the left; by default derived from the extract and its location.
    """
    mapped, extract = extract, _with_lanes_of_neighbours(extract, service=service)
    pieces = list(_pieces(extract, window, service=service))
    widened = tuple(way for number, way in pieces if number in mapped.ways and mapped.ways[number].tags is not way.tags)
    used = list(dict.fromkeys(number for _, way in pieces for number in way.nodes))
    notes: list[str] = []
    if left_hand is None:
        left_hand, reason = drives_on_the_left(extract)
        notes.append(f"traffic keeps to the {'left' if left_hand else 'right'}: {reason}")
    # Elevations are used only if nearly all nodes have one: a few tagged nodes among untagged ones would make steps.
    heights = [elevation(extract.nodes[number]) for number in used]
    elevated = bool(used) and sum(height is not None for height in heights) >= MIN_ELEVATED * len(used)
    # netconvert guesses lanes, widths, pavements and signals by its own defaults. The streets are therefore written
    # with these made explicit, and with signals moved to the junctions that they control.
    ways = [way for _, way in pieces]
    medians = _Medians(extract, ways)
    places = dict(zip(extract.nodes, extract.in_metres(extract.nodes.values()), strict=True))
    signals = matched_signals(extract, ways, places)
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', '<osm version="0.6">']
    for number, height in zip(used, heights, strict=True):
        lines += _node(number, extract.nodes[number], height if elevated else None, signals)
    for number, way in pieces:
        lines += _way(number, way.nodes, _tags(way, medians, left_hand=left_hand))
    lines += _restrictions(extract, {number for number, _ in pieces})
    path.write_text(os.linesep.join([*lines, "</osm>", ""]), encoding="utf-8")
    return StreetFile(
        elevated,
        left_hand,
        roundabouts=joined(way.nodes for way in ways if is_roundabout(way.tags)),
        slip_ends=tuple(_slip_ends(extract, ways)),
        ways=dict(pieces),
        structures=structures(extract, pieces, places),
        lone_signals=signals.unmatched,
        widened=widened,
        notes=tuple(notes),
    )


def _with_lanes_of_neighbours(extract: Extract, *, service: bool) -> Extract:
    """Return the extract with lanes for short pieces of streets that have no number of lanes between pieces that do.

    Such a piece would narrow the street to one lane in each direction for the length of a junction.
    """
    streets = {
        number: way
        for number, way in extract.ways.items()
        if is_street(way.tags, service=service) and len(way.nodes) > 1
    }
    at: dict[int, list[int]] = {}
    for number, way in streets.items():
        for end in {way.nodes[0], way.nodes[-1]}:
            at.setdefault(end, []).append(number)

    def onward(number: int, end: int) -> list[int]:
        way = streets[number]
        return [other for other in at[end] if other != number and _continues(way, streets[other], end)]

    short = {
        number: [onward(number, end) for end in (way.nodes[0], way.nodes[-1])]
        for number, way in streets.items()
        if not has_lane_count(way.tags) and not implausible_lanes(way.tags) and _is_short(extract, way)
    }

    def leads_on(side: Sequence[int]) -> bool:
        return any(one in short or has_lane_count(streets[one].tags) for one in side)

    # A chain of short pieces counts if both of its ends lead on to pieces with lanes.
    while loose := [number for number, around in short.items() if not all(map(leads_on, around))]:
        short = {number: around for number, around in short.items() if number not in loose}
    while short:
        known = {number: _widest(streets, number, itertools.chain(*around)) for number, around in short.items()}
        filled = {number: tags for number, tags in known.items() if tags is not None}
        if not filled:
            break
        for number, tags in filled.items():
            streets[number] = replace(streets[number], tags={**tags, **streets[number].tags})
            del short[number]
    return replace(extract, ways={**extract.ways, **streets})


def _widest(streets: Mapping[int, Way], number: int, onward: Iterable[int]) -> Tags | None:
    """Return the tags for lanes of the widest street that continues a way; None if none has a number of lanes.

    A lane too many is a taper, and one too few is a post in a lane.
    """
    known = [streets[other] for other in onward if has_lane_count(streets[other].tags)]
    options = (_lanes_along(streets[number], other) for other in known)
    return max(options, key=lambda tags: sum(lane_counts(tags).values()), default=None)


def _is_short(extract: Extract, way: Way) -> bool:
    """Return whether a way is no longer than `SHORT_PIECE`; False if the extract lacks one of its nodes."""
    line = extract.in_metres(extract.line(way))
    return len(line) == len(way.nodes) and float(np.hypot(*np.diff(line, axis=0).T).sum()) <= SHORT_PIECE


def _is_against(way: Way, other: Way) -> bool:
    """Return whether two ways with a common end are drawn towards each other, or away from each other."""
    return way.nodes[0] == other.nodes[0] or way.nodes[-1] == other.nodes[-1]


def _continues(way: Way, other: Way, end: int) -> bool:
    """Return whether a street continues another one, which ends at a node, in driving direction."""
    one_way = is_one_way(way.tags)
    against = (way.nodes[0] == end) == (other.nodes[0] == end)
    return (
        way.tags.get("name") == other.tags.get("name")
        and one_way == is_one_way(other.tags)
        and not (one_way and against)
    )


def _lanes_along(way: Way, other: Way) -> Tags:
    """Return the tags for lanes of a street that continues a way, seen along that way."""
    tags = reversed_tags(other.tags) if _is_against(way, other) else dict(other.tags)
    kept = {key: value for key, value in tags.items() if key.partition(":")[0] in ("lanes", "width", "placement")}
    counts = {f"lanes:{direction}": str(number) for direction, number in lane_counts(tags).items()}
    return kept if "lanes" in kept else kept | counts


def _slip_ends(extract: Extract, ways: Sequence[Way]) -> Iterator[int]:
    """Yield the ends of one-way links more than `JOIN_DISTANCE` from any other node where streets meet."""
    # Adjacency of nodes over all streets: more than two neighbours make a node a junction, two only a bend or a joint
    # between two ways.
    neighbours: dict[int, set[int]] = {}
    for way in ways:
        for one, other in itertools.pairwise(way.nodes):
            neighbours.setdefault(one, set()).add(other)
            neighbours.setdefault(other, set()).add(one)
    meeting = [number for number, others in neighbours.items() if len(others) > 2]
    places = extract.in_metres([extract.nodes[number] for number in meeting])
    links = {end for way in ways if is_link(way.tags) and is_one_way(way.tags) for end in (way.nodes[0], way.nodes[-1])}
    for number, place in zip(meeting, places, strict=True):
        # The smallest distance is that of the node to itself, 0; the second smallest is to the nearest other junction.
        if number in links and np.sort(np.hypot(*(places - place).T))[1:2].min(initial=math.inf) > JOIN_DISTANCE:
            yield number


def joined(ways: Iterable[tuple[int, ...]]) -> tuple[frozenset[int], ...]:
    """Return the node sets of connected groups of ways; ways that share a node belong to one group."""
    found: list[frozenset[int]] = []
    for nodes in ways:
        # A way may connect several groups that were separate so far: all of them are merged with it.
        met = [one for one in found if not one.isdisjoint(nodes)]
        found = [*(one for one in found if one not in met), frozenset(nodes).union(*met)]
    return tuple(found)


def elevation(node: Node) -> float | None:
    """Return the elevation of a node from its tags, metres; None without a plausible one."""
    try:
        value = float(node.tags.get("ele", ""))
    except ValueError:
        return None
    return value if -500.0 < value < 9000.0 else None


def _pieces(extract: Extract, window: tuple[float, float, float, float], *, service: bool) -> Iterator[tuple[int, Way]]:
    """Yield the streets within a window; a street that leaves it and returns is split into pieces with new ids."""
    south, west, north, east = window
    # New ids start above all ids of the extract. The first piece keeps the id of its way, so that turn restrictions,
    # which refer to ways by id, still apply to it.
    fresh = max(extract.ways, default=0)
    for number, way in extract.ways.items():
        if not (is_street(way.tags, service=service) or is_track(way.tags)):
            continue
        inside = [
            (node := extract.nodes.get(one)) is not None
            and south <= node.latitude <= north
            and west <= node.longitude <= east
            for one in way.nodes
        ]
        runs = [list(run) for held, run in itertools.groupby(range(len(inside)), inside.__getitem__) if held]
        for place, run in enumerate(runs):
            nodes = way.nodes[max(run[0] - 1, 0) : run[-1] + 2]  # one node beyond, where the extract has it
            # Every piece shares the tags object of its way: `bridges` and `heights` find the pieces of one way by its
            # identity.
            held = tuple(one for one in nodes if one in extract.nodes)
            if len(held) < 2:
                continue
            fresh += place > 0
            yield (number if place == 0 else fresh), Way(held, way.tags)


def _node(number: int, node: Node, height: float | None, signals: Signals) -> list[str]:
    # The reader counts longitudes from the middle of the window, so that they may leave ±180 degrees near the date
    # line.
    longitude = math.remainder(node.longitude, 360.0)
    place = f'<node id="{number}" lat="{node.latitude:.9f}" lon="{longitude:.9f}"'
    tags = {key: node.tags[key] for key in ("highway", "crossing", "railway") if key in node.tags}
    # Signals in front of a junction are written at the junction instead: netconvert drops them where they are mapped.
    if number in signals.moved:
        tags = {key: value for key, value in tags.items() if key != "highway"}
    if number in signals.junctions:
        tags["highway"] = "traffic_signals"
    if height is not None:
        tags["ele"] = f"{height:.3f}"
    return [f"{place}/>"] if not tags else [f"{place}>", *_tag_lines(tags), "</node>"]


def _way(number: int, nodes: Iterable[int], tags: Mapping[str, str]) -> list[str]:
    return [f'<way id="{number}">', *(f'<nd ref="{one}"/>' for one in nodes), *_tag_lines(tags), "</way>"]


def _tag_lines(tags: Mapping[str, str]) -> list[str]:
    return [f"<tag k={quoteattr(key)} v={quoteattr(value)}/>" for key, value in tags.items()]


def way_id(name: str) -> int:
    """Return the id of the way that an edge of netconvert, such as ``-12#3``, was made from; 0 if it has none."""
    digits = "".join(itertools.takewhile(str.isdigit, name.removeprefix("-")))
    return int(digits) if digits else 0


def _restrictions(extract: Extract, streets: set[int]) -> Iterator[str]:
    for number, relation in extract.relations.items():
        ways = [ref for kind, ref, _ in relation.members if kind == "way"]
        # A restriction that refers to a way outside the written streets cannot be resolved and is left out.
        if relation.tags.get("type") == "restriction" and ways and streets.issuperset(ways):
            yield f'<relation id="{number}">'
            for kind, ref, role in relation.members:
                yield f'<member type={quoteattr(kind)} ref="{ref}" role={quoteattr(role)}/>'
            yield from _tag_lines(relation.tags)
            yield "</relation>"


def _tags(way: Way, medians: "_Medians", *, left_hand: bool) -> dict[str, str]:
    """Return the tags of a street for netconvert, with explicit lanes, widths, pavements and cycle lanes."""
    given = way.tags
    tags = {key: given[key] for key in COPIED if key in given} | ({"name": name} if (name := shown_name(given)) else {})
    if given.get("railway") in TRACKS and "highway" not in given:
        return tags
    if given.get("highway") == "road":  # a street of unknown class, which netconvert does not have
        tags["highway"] = "unclassified"
    lanes, widths = lane_counts(given), lane_widths(given)
    if not is_one_way(given) or lanes.get("backward", 0) > 1:
        tags |= {"lanes": str(sum(lanes.values())), "oneway": "no"}
        tags |= {f"lanes:{direction}": str(number) for direction, number in lanes.items()}
    else:
        tags |= {"lanes": str(lanes["forward"])} | ({"busway": "opposite_lane"} if has_contraflow(given) else {})
    cycle = {direction: cycle_lane(given, direction, left_hand=left_hand) for direction in DIRECTIONS}
    left, right = _sidewalks(way, medians, left_hand=left_hand)
    paved = dict(zip(DIRECTIONS, (left, right) if left_hand else (right, left), strict=True))
    # In the written tags ``right`` always is the side where traffic keeps, as in a right-hand network: for left-hand
    # traffic both sides are exchanged.
    tags |= {
        f"cycleway:{side}": kind
        for side, kind in zip(("right", "left"), cycle.values(), strict=True)
        if kind is not None
    }
    tags["sidewalk"] = _SIDES[paved["backward"], paved["forward"]]
    # A list of widths has one entry for each lane that netconvert makes, left to right in driving direction: the outer
    # lanes, cycle lane and pavement, are last in right-hand and first in left-hand traffic. Without a list, a pavement
    # that lies against the direction of a one-way street would be as wide as a lane.
    for direction in DIRECTIONS:
        outer = [CYCLE_LANE_WIDTH] * (cycle[direction] is not None) + [SIDEWALK_WIDTH] * paved[direction]
        each = [*(outer[::-1] if left_hand else ()), *widths.get(direction, ()), *(() if left_hand else outer)]
        key = "width:lanes" if direction == "forward" and tags.get("oneway") != "no" else f"width:lanes:{direction}"
        if each:
            tags[key] = "|".join(f"{one:.2f}" for one in each)
    return tags


def shown_name(tags: Tags) -> str:
    """Return the displayed name of a street, "" if it has none.

    Names in scripts that the font of the pictures lacks are replaced by ``name:en``; roads without a name use ``ref``.
    """
    name = tags.get("name") or tags.get("ref", "")
    return tags.get("name:en") or name if any(character >= _FIRST_OTHER for character in name) else name


def _sidewalks(way: Way, medians: "_Medians", *, left_hand: bool) -> tuple[bool, bool]:
    """Return whether a pavement lies on the left and on the right of a street."""
    left, right = (_sidewalk_tag(way.tags, side) for side in ("left", "right"))
    if left is None or right is None:
        kind = way.tags.get("highway", "")
        # Assumptions for the sides without a tag. Roundabouts have a pavement on the outside only: their island is on
        # the left in right-hand traffic. Slip roads have one at the kerb side; the island between them and the street
        # has none. One-way carriageways of a dual street have none on the side of the other carriageway.
        usual_left = usual_right = kind in PAVED_CLASSES
        if is_roundabout(way.tags):
            usual_left, usual_right = (True, False) if left_hand else (False, True)
        elif kind.endswith("_link") and kind not in ("motorway_link", "trunk_link"):
            usual_left, usual_right = left_hand, not left_hand
        elif usual_left and is_one_way(way.tags):
            median_left, median_right = medians.beside(way)
            usual_left, usual_right = not median_left, not median_right
        left = usual_left if left is None else left
        right = usual_right if right is None else right
    return left, right


def _sidewalk_tag(tags: Tags, side: str) -> bool | None:
    """Return whether tags give a pavement on one side, None without such tags."""
    own = tags.get(f"sidewalk:{side}", tags.get("sidewalk:both"))
    if own is not None:
        return own not in ("no", "none")
    # ``separate`` is a pavement mapped as a way of its own: it exists, and netconvert lays it next to the street.
    whole = tags.get("sidewalk")
    if whole is None:
        return None
    return whole in ("both", "yes", "separate", side)


class _Medians:
    """One-way streets of an extract, indexed to find the side on which the opposite carriageway of one lies."""

    def __init__(self, extract: Extract, ways: Iterable[Way]) -> None:
        self._extract = extract
        # Roundabouts and slip roads lie next to streets too, but are not the other carriageway of one.
        starts, stops, names = [], [], []
        for way in ways:
            if is_one_way(way.tags) and way.tags.get("junction") is None and not is_link(way.tags):
                line = self._line(way)
                starts.append(line[:-1])
                stops.append(line[1:])
                names += [way.tags.get("name", "")] * (len(line) - 1)
        start, stop = (np.concatenate([np.empty((0, 2)), *points]) for points in (starts, stops))
        self._along = (stop - start) / np.maximum(np.hypot(*(stop - start).T), 1e-9)[:, None]
        self._names = np.array(names, dtype=object)
        self._tree = shapely.STRtree(shapely.linestrings(np.stack([start, stop], axis=1)))

    def beside(self, way: Way) -> tuple[bool, bool]:
        """Return whether the opposite carriageway of a one-way street lies on its left, and on its right."""
        line = self._line(way)
        steps = np.diff(line, axis=0)
        if not len(steps):
            return False, False
        middle, along = line[:-1] + steps / 2, steps / np.maximum(np.hypot(*steps.T), 1e-9)[:, None]
        aside = np.column_stack([-along[:, 1], along[:, 0]])

        def opposite(sign: float) -> bool:
            # Cast a ray to the side from the middle of each segment: where carriageways part around a refuge, they are
            # parallel for a few metres only. It starts at 2 m, so as not to meet the street itself.
            rays = shapely.linestrings(np.stack([middle + by * sign * aside for by in (2.0, MAX_MEDIAN)], axis=1))
            segment, other = self._tree.query(rays, predicate="intersects")
            # The other carriageway has the same name and leads the opposite way, within 37 degrees (cosine below -0.8).
            # A parallel one-way street of the same direction does not make the space between them a median.
            cosine = (self._along[other] * along[segment]).sum(axis=1)
            return bool(((cosine < -0.8) & (self._names[other] == way.tags.get("name", ""))).any())

        return opposite(1.0), opposite(-1.0)

    def _line(self, way: Way) -> Float:
        """Return the line of a way (n, 2), metres from the extract's first node, in driving direction."""
        return self._extract.in_metres(self._extract.line(way))


def is_link(tags: Tags) -> bool:
    """Return whether a street is a slip road or a ramp."""
    return tags.get("highway", "").endswith("_link")
