"""Weights of the sites of a network from the flows that SUMO has counted."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import shapely

from ..errors import SeipError
from ..geometry.geo_reference import GeoReference
from ..limits import COUNT, MAP_COORDINATE, TIME, Limits
from ..progress import Progress
from ..storage.xml_stream import Attributes, read_tags
from ..world.openstreetmap.network_junctions import metres
from ..world.openstreetmap.signals import SIGNAL_REACH
from .network_sites import NetworkPlace


def with_flows(
    places: Sequence[NetworkPlace], network: Path, counts: Path
) -> Generator[Progress, None, tuple[NetworkPlace, ...]]:
    """Return sites with the vehicles per hour that drive into each as its weight.

    A vehicle drives into a site where it leaves an edge that ends within 40 m of the site and begins farther away, so
    that the edges between the nodes of a large junction do not count.

    Parameters
    ----------
    network : Path
        Network of SUMO (``.net.xml``) with a projection, which has a street at each site.
    counts : Path
        Output of SUMO's ``edgeData`` on this network, of one interval or more.

    Raises
    ------
    SeipError
        A file cannot be read, is of another kind, or has no street or no vehicle at the sites.
    """
    streets = _Streets(network.name)
    yield from read_tags(network, streets.read_element)
    flows = _Flows(counts.name)
    yield from read_tags(counts, flows.read_element)
    if not flows.seconds:
        raise SeipError(f"{counts.name} is no output of edgeData (it has no interval): have SUMO write one")
    near = streets.near(places)
    weights = []
    for place, nodes in zip(places, near, strict=True):
        ends = [(edge, begin in nodes, end in nodes) for edge, (begin, end) in streets.edges.items()]
        entering = [edge for edge, inside, ahead in ends if ahead and not inside]
        if not entering:
            raise SeipError(f"{network.name} has no street that ends at {place.name}: give a network of these sites")
        weights.append(3600.0 * sum(flows.left[edge] for edge in entering) / flows.seconds)
    if not any(weights):
        raise SeipError(f"{counts.name} counts no vehicle at any site: simulate traffic there")
    return tuple(replace(place, weight=weight) for place, weight in zip(places, weights, strict=True))


@dataclass
class _Streets:
    """Handler of a stream of XML that collects the nodes and edges of a network, and its projection."""

    name: str
    nodes: dict[str, tuple[float, float]] = field(default_factory=dict)
    edges: dict[str, tuple[str, str]] = field(default_factory=dict)
    reference: GeoReference = GeoReference()

    def read_element(self, tag: str, attributes: Attributes) -> None:
        """Read an element."""
        if tag == "location":
            east, north = (_number(self.name, tag, part, MAP_COORDINATE) for part in _offset(attributes))
            self.reference = GeoReference(attributes.get("projParameter", ""), (-east, -north, 0.0, 0.0))
        elif tag == "junction" and attributes.get("type") != "internal":
            x, y = (_number(self.name, tag, attributes.get(axis, ""), MAP_COORDINATE) for axis in "xy")
            self.nodes[attributes.get("id", "")] = (x, y)
        elif tag == "edge" and not attributes.get("function"):
            self.edges[attributes.get("id", "")] = (attributes.get("from", ""), attributes.get("to", ""))

    def near(self, places: Sequence[NetworkPlace]) -> list[set[str]]:
        """Return the nodes within reach of each site."""
        if not self.edges:
            raise SeipError(f"{self.name} is not a SUMO network (it has no edges): choose a .net.xml file")
        points = np.column_stack([np.array(list(self.nodes.values())), np.zeros(len(self.nodes))])
        geographic = self.reference.geographic(points)
        if geographic is None:
            raise SeipError(
                f"{self.name} names no projection that is known: convert the streets with netconvert --proj.utm"
            )
        origin = (places[0].latitude, places[0].longitude)
        tree = shapely.STRtree(shapely.points(metres(geographic[:, 1::-1], origin)))
        names = list(self.nodes)
        own = metres([(place.latitude, place.longitude) for place in places], origin)
        found = (tree.query(shapely.Point(*point), "dwithin", distance=SIGNAL_REACH) for point in own)
        return [{names[number] for number in numbers.tolist()} for numbers in found]


@dataclass
class _Flows:
    """Handler of a stream of XML that sums the vehicles that left each edge, and the length of all intervals."""

    name: str
    seconds: float = 0.0
    left: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))

    def read_element(self, tag: str, attributes: Attributes) -> None:
        """Read an element."""
        if tag == "interval":
            begin, end = (_number(self.name, tag, attributes.get(one, ""), TIME) for one in ("begin", "end"))
            self.seconds += max(0.0, end - begin)
        elif tag == "edge":
            self.left[attributes.get("id", "")] += _number(self.name, tag, attributes.get("left", "0"), COUNT)


def _offset(attributes: Attributes) -> list[str]:
    parts = attributes.get("netOffset", "0,0").split(",")
    return parts if len(parts) == 2 else ["", ""]


def _number(name: str, tag: str, text: str, limits: Limits) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not limits.allow(value):
        raise SeipError(f"{name}: a number of <{tag}> must be {limits}, not {text[:40]!r}: write it again with SUMO")
    return value
