"""A street network of SUMO: edges, their lanes, and the connections between edges."""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from seip_addon.core.arrays import Float
from seip_addon.core.errors import SeipError
from seip_addon.core.limits import MAP_COORDINATE, ROAD_LENGTH, Limits
from seip_addon.core.progress import finish
from seip_addon.core.storage.xml_stream import Attributes, quoted, read_tags

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
        Edges by id, in the order of the file.
    onward : dict of str to list of (str, str)
        Next edges of each edge, with the direction: ``l``, ``s`` or ``r`` (left, straight, right).
    signalised : dict of str to (2,) float64, metres
        Positions of the nodes with traffic lights.
    """

    edges: dict[str, NetworkEdge]
    onward: dict[str, list[tuple[str, str]]]
    signalised: dict[str, Float]

    @property
    def arms(self) -> list[NetworkEdge]:
        """Edges on which vehicles enter: driving edges without a preceding edge and with a next one."""
        entered = {edge for ways in self.onward.values() for edge, _ in ways}
        return [
            edge for edge in self.edges.values() if edge.of(DRIVING) and edge.id not in entered and self.leads_on(edge)
        ]

    def leads_on(self, edge: NetworkEdge) -> bool:
        """Return whether an edge has a next edge for vehicles."""
        return bool(self.onward.get(edge.id))


def read_network(path: str | os.PathLike[str]) -> StreetNetwork:
    """Read a SUMO network.

    Raises
    ------
    SeipError
        The file cannot be read, is not a SUMO network, or has lanes with lengths or coordinates out of their limits.
    """
    reader = _Reader(Path(path).name)
    finish(read_tags(path, reader.take))
    if not reader.edges:
        raise SeipError(f"{reader.name} is not a SUMO network: it has no edges; name a .net.xml")
    return StreetNetwork(reader.edges, reader.onward, reader.signalised)


class _Reader:
    """Handler of a stream of XML that collects edges, connections and junctions."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.edges: dict[str, NetworkEdge] = {}
        self.onward: dict[str, list[tuple[str, str]]] = {}
        self.signalised: dict[str, Float] = {}
        self._current = ""  # edge of the lanes that follow in the stream; "" for internal edges of a junction

    def take(self, tag: str, attributes: Attributes) -> None:
        """Read an element; an error names the file and the element."""
        take = {"edge": self._edge, "lane": self._lane, "connection": self._connection, "junction": self._junction}
        if tag not in take:
            return
        try:
            take[tag](attributes)
        except (KeyError, IndexError, ValueError) as error:
            named = f"{self.name}: <{tag}> {quoted(attributes.get('id', ''))}"
            fault = f"has no {error}" if isinstance(error, KeyError) else str(error)
            raise SeipError(f"{named} {fault}; let netconvert write the network again") from error

    def _edge(self, attributes: Attributes) -> None:
        # Edges with a function (internal, crossing, walkingarea) are parts of junctions, not streets: their lanes
        # are skipped.
        self._current = "" if attributes.get("function") else attributes["id"]
        if self._current:
            self.edges[self._current] = NetworkEdge(self._current, attributes["to"], ())

    def _lane(self, attributes: Attributes) -> None:
        if self._current:
            edge = self.edges[self._current]
            self.edges[self._current] = NetworkEdge(edge.id, edge.end, (*edge.lanes, _lane(attributes)))

    def _connection(self, attributes: Attributes) -> None:
        begin = attributes["from"]
        if begin not in self.edges:
            return
        way, lane = (attributes["to"], attributes["dir"].lower()), int(attributes["fromLane"])
        if not 0 <= lane < len(self.edges[begin].lanes):
            raise ValueError(f"begins on lane {lane} of an edge with {len(self.edges[begin].lanes)}")
        ways = self.onward.setdefault(begin, [])
        # A lane also for pedestrians has connections to crossings, which are not edges for vehicles. Partly left
        # and partly right (L, R) count as left and right; turnarounds (t) are left out, as the demand has no share of
        # them.
        onward = way[0] in self.edges and way[1] in {"l", "s", "r"}
        if onward and self.edges[begin].lanes[lane].use == DRIVING and way not in ways:
            ways.append(way)

    def _junction(self, attributes: Attributes) -> None:
        if attributes.get("type", "").startswith("traffic_light"):
            place = np.array([float(attributes["x"]), float(attributes["y"])])
            self.signalised[attributes["id"]] = _within(MAP_COORDINATE, "a coordinate", place)


def _lane(attributes: Attributes) -> NetworkLane:
    corners = [corner.split(",")[:2] for corner in attributes["shape"].split()]
    line = np.array(corners, dtype=np.float64)
    if line.ndim != 2 or len(line) < 2 or line.shape[1] != 2:
        raise ValueError("has a shape that is not a line of points x,y")
    index = int(attributes["index"])
    if index < 0:
        raise ValueError(f"has the index {index}")
    length = _within(ROAD_LENGTH, "length", np.array(float(attributes["length"])))
    return NetworkLane(index, _use(attributes), float(length), _within(MAP_COORDINATE, "a coordinate", line))


def _within(limits: Limits, what: str, values: Float) -> Float:
    if fault := limits.fault(values):
        raise ValueError(f"has a lane or node of which {what} {fault}")
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
