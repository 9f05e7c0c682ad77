"""A street network of SUMO: edges, their lanes, and the connections between edges."""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...arrays import Float
from ...counts import counted
from ...errors import SeipError
from ...limits import MAP_COORDINATE, ROAD_LENGTH, Limits
from ...progress import finish
from ...storage.xml_stream import Attributes, quoted, read_tags

WALKING, PARKING, DRIVING, OTHER = "walking", "parking", "driving", "other"  # uses of lanes
PARKED_CLASS = "custom1"  # the only vClass allowed in a parking lane


@dataclass(frozen=True, eq=False)
class NetworkLane:
    """A lane: its number from the right, its use, its length in metres, and its centre line (k, 2)."""

    index: int
    use: str
    length: float
    line: Float


@dataclass(frozen=True, eq=False)
class NetworkEdge:
    """A one-way street from one node to the next, with its lanes from the right."""

    id: str
    to_node: str
    lanes: tuple[NetworkLane, ...]

    def lanes_for(self, use: str) -> tuple[NetworkLane, ...]:
        """Return the lanes for a use, from the right."""
        return tuple(lane for lane in self.lanes if lane.use == use)


@dataclass(frozen=True, eq=False)
class StreetNetwork:
    """A street network.

    Parameters
    ----------
    edges : dict of str to NetworkEdge
        Edges by id, in the order of the file.
    turns : dict of str to list of (str, str)
        Next edges of each edge, with the direction: ``l``, ``s`` or ``r`` (left, straight, right).
    signalised : dict of str to (2,) float64, metres
        Positions of the nodes with traffic lights.
    """

    edges: dict[str, NetworkEdge]
    turns: dict[str, list[tuple[str, str]]]
    signalised: dict[str, Float]

    @property
    def arms(self) -> list[NetworkEdge]:
        """Edges on which vehicles enter: driving edges without a preceding edge and with a next one."""
        next_edges = {edge for turns in self.turns.values() for edge, _ in turns}
        return [
            edge
            for edge in self.edges.values()
            if edge.lanes_for(DRIVING) and edge.id not in next_edges and self.has_next_edge(edge)
        ]

    def has_next_edge(self, edge: NetworkEdge) -> bool:
        """Return whether an edge has a next edge for vehicles."""
        return bool(self.turns.get(edge.id))


def read_network(path: str | os.PathLike[str]) -> StreetNetwork:
    """Read a SUMO network.

    Raises
    ------
    SeipError
        The file cannot be read, is not a SUMO network, or has lanes with lengths or coordinates out of their limits.
    """
    reader = _Reader(Path(path).name)
    finish(read_tags(path, reader.read_element))
    if not reader.edges:
        raise SeipError(f"{reader.name} is not a SUMO network (it has no edges): choose a .net.xml file")
    return StreetNetwork(reader.edges, reader.turns, reader.signalised)


class _Reader:
    """Handler of a stream of XML that collects edges, connections and junctions."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.edges: dict[str, NetworkEdge] = {}
        self.turns: dict[str, list[tuple[str, str]]] = {}
        self.signalised: dict[str, Float] = {}
        self._current = ""  # edge of the lanes that follow in the stream; "" for internal edges of a junction

    def read_element(self, tag: str, attributes: Attributes) -> None:
        """Read an element; an error names the file and the element."""
        readers = {"edge": self._edge, "lane": self._lane, "connection": self._connection, "junction": self._junction}
        if tag not in readers:
            return
        try:
            readers[tag](attributes)
        except (KeyError, IndexError, ValueError) as error:
            fault = f"the attribute {error} is missing" if isinstance(error, KeyError) else str(error)
            raise SeipError(
                f"{self.name} is not a valid SUMO network: <{tag}> {_named(attributes)}: {fault}; "
                "write the network again with netconvert"
            ) from error

    def _edge(self, attributes: Attributes) -> None:
        # Edges with a function (internal, crossing, walkingarea) are parts of junctions, not streets: their lanes
        # are skipped.
        self._current = "" if attributes.get("function") else attributes["id"]
        if self._current:
            self.edges[self._current] = NetworkEdge(self._current, attributes["to"], ())

    def _lane(self, attributes: Attributes) -> None:
        if self._current:
            edge = self.edges[self._current]
            self.edges[self._current] = NetworkEdge(edge.id, edge.to_node, (*edge.lanes, _lane(attributes)))

    def _connection(self, attributes: Attributes) -> None:
        begin = attributes["from"]
        if begin not in self.edges:
            return
        turn, lane = (attributes["to"], attributes["dir"].lower()), int(attributes["fromLane"])
        lanes = self.edges[begin].lanes
        if not 0 <= lane < len(lanes):
            raise ValueError(f"fromLane is {lane}, but the edge has {counted(len(lanes), 'lane')}")
        turns = self.turns.setdefault(begin, [])
        # A lane also for pedestrians has connections to crossings, which are not edges for vehicles. Partly left
        # and partly right (L, R) count as left and right; turnarounds (t) are left out, as the demand has no share of
        # them.
        is_turn = turn[0] in self.edges and turn[1] in {"l", "s", "r"}
        if is_turn and lanes[lane].use == DRIVING and turn not in turns:
            turns.append(turn)

    def _junction(self, attributes: Attributes) -> None:
        if attributes.get("type", "").startswith("traffic_light"):
            position = np.array([float(attributes["x"]), float(attributes["y"])])
            self.signalised[attributes["id"]] = _checked(MAP_COORDINATE, "a coordinate", position)


def _named(attributes: Attributes) -> str:
    """Return the name of an element in a message: its id, or for a connection its edges."""
    if "from" in attributes and "id" not in attributes:
        return f"from {quoted(attributes['from'])} to {quoted(attributes.get('to', ''))}"
    return quoted(attributes.get("id", ""))


def _lane(attributes: Attributes) -> NetworkLane:
    corners = [corner.split(",")[:2] for corner in attributes["shape"].split()]
    line = np.array(corners, dtype=np.float64)
    if line.ndim != 2 or len(line) < 2 or line.shape[1] != 2:
        raise ValueError("the shape is not a line of two or more points x,y")
    index = int(attributes["index"])
    if index < 0:
        raise ValueError(f"the index is {index}, not 0 or more")
    length = _checked(ROAD_LENGTH, "the length", np.array(float(attributes["length"])))
    return NetworkLane(index, _use(attributes), float(length), _checked(MAP_COORDINATE, "a coordinate", line))


def _checked(limits: Limits, quantity: str, values: Float) -> Float:
    if fault := limits.fault(values):
        raise ValueError(f"{quantity} {fault}")
    return values


def _use(attributes: Attributes) -> str:
    allowed = attributes.get("allow", "").split()
    if allowed == ["pedestrian"]:
        return WALKING
    if allowed == [PARKED_CLASS]:
        return PARKING
    # A lane has either a list of allowed or a list of closed classes; without both it is open to all.
    closed = attributes.get("disallow", "").split()
    drives = "passenger" in allowed if allowed else "passenger" not in closed and "all" not in closed
    return DRIVING if drives else OTHER
