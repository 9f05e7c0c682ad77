"""A street network as SUMO drives on it: edges, their lanes, and how one leads to the next."""

import os
from dataclasses import dataclass

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.progress import finish
from seip_addon.core.storage.xml_stream import Attributes, read_tags

WALKING, PARKING, DRIVING, OTHER = "walking", "parking", "driving", "other"  # uses of lanes
PARKED_CLASS = "custom1"  # the vClass that alone may stand in a parking lane


@dataclass(frozen=True, eq=False)
class NetworkLane:
    """A lane: its number from the right, what it is for, its length in metres, and its middle line (k, 2)."""

    index: int
    use: str
    length: float
    line: Float


@dataclass(frozen=True, eq=False)
class NetworkEdge:
    """A one-way street from one node to the next, with its lanes from the right."""

    id: str
    end: str
    lanes: tuple[NetworkLane, ...]

    def of(self, use: str) -> tuple[NetworkLane, ...]:
        """Return the lanes for a use, from the right."""
        return tuple(lane for lane in self.lanes if lane.use == use)


@dataclass(frozen=True, eq=False)
class StreetNetwork:
    """A street network.

    Parameters
    ----------
    edges : dict of str to NetworkEdge
        In the order of the file.
    onward : dict of str to list of (str, str)
        From an edge to which, and how it goes there: ``l``, ``s`` or ``r``.
    signalised : dict of str to (2,) float64, metres
        Where the nodes with traffic lights are.
    """

    edges: dict[str, NetworkEdge]
    onward: dict[str, list[tuple[str, str]]]
    signalised: dict[str, Float]

    @property
    def arms(self) -> list[NetworkEdge]:
        """Edges on which vehicles come in: nothing leads to them, and they lead on."""
        entered = {edge for ways in self.onward.values() for edge, _ in ways}
        return [
            edge for edge in self.edges.values() if edge.of(DRIVING) and edge.id not in entered and self.leads_on(edge)
        ]

    def leads_on(self, edge: NetworkEdge) -> bool:
        """Return whether vehicles can drive on from an edge."""
        return bool(self.onward.get(edge.id))


def read_network(path: str | os.PathLike[str]) -> StreetNetwork:
    """Read a SUMO network."""
    edges: dict[str, NetworkEdge] = {}
    onward: dict[str, list[tuple[str, str]]] = {}
    signalised: dict[str, Float] = {}
    current: list[str] = []  # the edge whose lanes come now; none within a junction

    def take(tag: str, attributes: Attributes) -> None:
        if tag == "edge":
            current[:] = [] if attributes.get("function") else [attributes["id"]]
            if current:
                edges[attributes["id"]] = NetworkEdge(attributes["id"], attributes["to"], ())
        elif tag == "lane" and current:
            edge = edges[current[0]]
            edges[current[0]] = NetworkEdge(edge.id, edge.end, (*edge.lanes, _lane(attributes)))
        elif tag == "connection" and attributes["from"] in edges:
            way = (attributes["to"], attributes["dir"].lower())
            drives = edges[attributes["from"]].lanes[int(attributes["fromLane"])].use == DRIVING
            ways = onward.setdefault(attributes["from"], [])
            if drives and way[1] in "lsr" and way not in ways:
                ways.append(way)
        elif tag == "junction" and attributes.get("type", "").startswith("traffic_light"):
            signalised[attributes["id"]] = np.array([float(attributes["x"]), float(attributes["y"])])

    finish(read_tags(path, take))
    return StreetNetwork(edges, onward, signalised)


def _lane(attributes: Attributes) -> NetworkLane:
    corners = [corner.split(",")[:2] for corner in attributes["shape"].split()]
    return NetworkLane(
        index=int(attributes["index"]),
        use=_use(attributes),
        length=float(attributes["length"]),
        line=np.array(corners, dtype=np.float64),
    )


def _use(attributes: Attributes) -> str:
    allowed = attributes.get("allow", "").split()
    if allowed == ["pedestrian"]:
        return WALKING
    if allowed == [PARKED_CLASS]:
        return PARKING
    closed = attributes.get("disallow", "").split()
    drives = "passenger" in allowed if allowed else "passenger" not in closed and "all" not in closed
    return DRIVING if drives else OTHER
