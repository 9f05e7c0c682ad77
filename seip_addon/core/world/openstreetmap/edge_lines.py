"""Lines of netconvert's edges, moved so that the lanes of each street lie where OpenStreetMap draws them.

netconvert lays the line between the directions of a street along its way, or centres a street with its pavements. In
OpenStreetMap the line of a way is the middle of the carriageway, unless the tag ``placement`` says otherwise.
"""

import itertools
from collections.abc import Iterator, Mapping

import numpy as np

from ...arrays import Float
from ...geometry.plan import beside
from ..traffic_simulation.street_network import NetworkEdge, StreetNetwork
from .extract import Way
from .street_lanes import divider_offset


def moved_edges(network: StreetNetwork, ways: Mapping[int, Way]) -> Iterator[str]:
    """Yield the elements of a file of edges that move those of a network to where the lanes of their ways begin.

    Parameters
    ----------
    network : StreetNetwork
        Network of netconvert in which the lines of edges are those of their ways.
    ways : mapping of int to Way
        Streets by the id under which they were written for netconvert.
    """
    lines = {name: _line(edge, network) for name, edge in network.edges.items()}
    leaving: dict[str, list[NetworkEdge]] = {}
    entering: dict[str, list[NetworkEdge]] = {}
    for edge in network.edges.values():
        leaving.setdefault(edge.from_node, []).append(edge)
        entering.setdefault(edge.to_node, []).append(edge)
    for name, edge in network.edges.items():
        way = ways.get(way_id(name))
        if way is None or "highway" not in way.tags:
            continue
        backward = name.startswith("-")
        aside = divider_offset(way.tags, left_hand=network.left_hand) * (-1.0 if backward else 1.0)
        aside -= _off(edge, left_hand=network.left_hand)
        # At a joint with another street the line bends as if both were one, so that moved lines meet there.
        before = _only(lines[one.id][-2] for one in entering.get(edge.from_node, ()) if one.from_node != edge.to_node)
        after = _only(lines[one.id][1] for one in leaving.get(edge.to_node, ()) if one.to_node != edge.from_node)
        own = lines[name]
        moved = beside(np.vstack([*before, own, *after]), -aside)[len(before) :][: len(own)]
        rows = (moved if moved[:, 2].any() else moved[:, :2]).tolist()
        shape = " ".join(",".join(f"{value:.6f}" for value in row) for row in rows)
        yield f'<edge id="{name}" spreadType="right" shape="{shape}"/>'


def _line(edge: NetworkEdge, network: StreetNetwork) -> Float:
    """Return the line of an edge (n, 3)."""
    if edge.line is not None:
        return edge.line
    return np.array([(*network.nodes[node], 0.0) for node in (edge.from_node, edge.to_node)])


def _off(edge: NetworkEdge, *, left_hand: bool) -> float:
    """Return how far the line of an edge is to the right of the line of its way, metres.

    netconvert moves the line of a street that it centres when it adds cycle lanes and pavements.
    """
    outer = sum(lane.width for lane in edge.lanes if lane.allowed in ({"pedestrian"}, {"bicycle"}))
    return (-0.5 if left_hand else 0.5) * outer if edge.centred else 0.0


def _only(points: Iterator[Float]) -> list[Float]:
    """Return the point in a list if there is one only, otherwise an empty list."""
    found = list(points)
    return found if len(found) == 1 else []


def way_id(name: str) -> int:
    """Return the id of the way that an edge, called for example ``-12#3``, was made from; 0 if it has none."""
    digits = "".join(itertools.takewhile(str.isdigit, name.removeprefix("-")))
    return int(digits) if digits else 0
