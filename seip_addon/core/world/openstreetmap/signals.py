"""Traffic signals of an extract, matched to the junctions that they control.

Many signals are mapped where traffic stops, some metres before the junction. netconvert drops them there, so they are
written at the first junction that this traffic reaches.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from ...base.arrays import Float
from .extract import Extract, Tags, Way

SIGNAL_REACH = 40.0  # metres from a stop line to the junction that its signals control, at most
CROSSING_REACH = 15.0  # metres: the same for signals of a pedestrian crossing, which need not belong to a junction
BEHIND_REACH = 15.0  # metres from signals back to the junction that they stand behind, at most


@dataclass(frozen=True)
class Signals:
    """Traffic signals of the streets of an extract.

    Parameters
    ----------
    junctions : frozenset of int
        Nodes of junctions with signals mapped nearby.
    moved : frozenset of int
        Nodes of those signals.
    unmatched : tuple of int
        Nodes of signals without a junction within reach.
    """

    junctions: frozenset[int]
    moved: frozenset[int]
    unmatched: tuple[int, ...]


def matched_signals(extract: Extract, streets: Sequence[Way], lines: Mapping[int, Float]) -> Signals:
    """Match the traffic signals on streets with junctions.

    Parameters
    ----------
    streets : sequence of Way
    lines : mapping of int to (2,) float64, metres
        Positions of the nodes by id.
    """
    neighbours: dict[int, list[int]] = {}
    found: dict[int, list[tuple[Way, int]]] = {}
    for way in streets:
        for place, node in enumerate(way.nodes):
            neighbours.setdefault(node, [])
            neighbours[node] += way.nodes[max(place - 1, 0) : place] + way.nodes[place + 1 : place + 2]
            if extract.nodes[node].tags.get("highway") == "traffic_signals":
                found.setdefault(node, []).append((way, place))
    junctions, moved, unmatched = set(), set(), []
    for node, places in found.items():
        if _is_junction(neighbours[node]):
            continue
        tags = extract.nodes[node].tags
        reach = SIGNAL_REACH
        if tags.get("crossing", "no") != "no" and _direction(tags) is None:
            reach = CROSSING_REACH
        ahead = {following for way, place in places for following in _ahead(way, place, tags)}
        ends = [
            end for following in sorted(ahead) for end in _first_junction(node, following, neighbours, lines, reach)
        ]
        if not ends:  # mapped at the post itself, which may stand behind the junction
            behind = set(neighbours[node]) - ahead
            ends = [
                end for one in sorted(behind) for end in _first_junction(node, one, neighbours, lines, BEHIND_REACH)
            ]
        if ends:
            junctions.add(min(ends)[1])
            moved.add(node)
        else:
            unmatched.append(node)
    return Signals(frozenset(junctions), frozenset(moved), tuple(unmatched))


def _is_junction(neighbours: Sequence[int]) -> bool:
    return len(set(neighbours)) > 2


def _direction(tags: Tags) -> str | None:
    """Return the direction of a way that signals control: ``forward`` or ``backward``, None for both."""
    given = tags.get("traffic_signals:direction", tags.get("direction"))
    return given if given in ("forward", "backward") else None


def _ahead(way: Way, place: int, tags: Tags) -> Iterator[int]:
    """Yield the nodes next to signals towards which the controlled traffic drives."""
    one_way = way.tags.get("oneway") in ("yes", "true", "1") or way.tags.get("junction") in ("roundabout", "circular")
    # The direction of a signal is that of the mapped way, which is reversed where traffic goes against it.
    direction = "forward" if one_way else _direction(tags)
    if place + 1 < len(way.nodes) and direction != "backward":
        yield way.nodes[place + 1]
    if place > 0 and direction != "forward":
        yield way.nodes[place - 1]


def _first_junction(
    node: int, following: int, neighbours: Mapping[int, Sequence[int]], lines: Mapping[int, Float], reach: float
) -> Iterator[tuple[float, int]]:
    """Yield distance (metres) and node of the first junction along a street, if it is within reach."""
    away = 0.0
    while True:
        away += math.dist(lines[node], lines[following])
        if away > reach:
            return
        if _is_junction(neighbours[following]):
            yield away, following
            return
        # Not a junction, so at most one neighbour is left besides the node that the walk came from.
        onward = sorted(set(neighbours[following]) - {node})
        if not onward:
            return
        node, following = following, onward[0]
