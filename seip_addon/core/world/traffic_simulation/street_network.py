"""A street network of SUMO: edges, their lanes, and the connections between edges."""

import os
from dataclasses import dataclass, replace
from pathlib import Path
from xml.sax.saxutils import unescape

import numpy as np

from ...base.arrays import Float
from ...base.counts import counted
from ...base.errors import SeipError
from ...base.limits import MAP_COORDINATE, ROAD_LENGTH, Limits
from ...base.progress import finish
from ...storage.xml_stream import Attributes, quoted, read_tags

WALKING, PARKING, DRIVING, OTHER = "walking", "parking", "driving", "other"  # uses of lanes
PARKED_CLASS = "custom1"  # the only vClass allowed in a parking lane
LANE_WIDTH, CROSSING_WIDTH = 3.2, 4.0  # metres: SUMO's widths of lanes and crossings without one
MIN_STEP = 1e-3  # metres between points of a line: closer ones are one point
_ELEMENTS = {"net", "location", "edge", "lane", "connection", "junction"}
_QUOTES = {"&apos;": "'", "&quot;": '"'}


@dataclass(frozen=True, eq=False)
class NetworkLane:
    """A lane.

    Parameters
    ----------
    index : int
        Number from the kerb.
    allowed, closed : frozenset of str
        Classes of vehicles that may use it and that may not; a lane with neither is open to all.
    width, length : float, metres
    points : (k, 3) float64, metres
        Centre line.
    """

    index: int
    allowed: frozenset[str]
    closed: frozenset[str]
    width: float
    length: float
    points: Float

    @property
    def line(self) -> Float:
        """Centre line in plan, (k, 2) metres."""
        return self.points[:, :2]

    @property
    def use(self) -> str:
        """Use of the lane: one of the constants of this module."""
        if self.allowed == {"pedestrian"}:
            return WALKING
        if self.allowed == {PARKED_CLASS}:
            return PARKING
        drives = "passenger" in self.allowed if self.allowed else self.closed.isdisjoint(("passenger", "all"))
        return DRIVING if drives else OTHER


@dataclass(frozen=True, eq=False)
class NetworkEdge:
    """A one-way street from one node to the next, or a part of a junction.

    Parameters
    ----------
    id, from_node, to_node, name : str
        Id, nodes at its ends, and name of the street.
    function : str
        Kind of a part of a junction (``internal``, ``crossing``, ``walkingarea``); "" for streets.
    line : (k, 3) float64, metres, or None
        Line that netconvert laid the lanes along, None if it is straight from node to node.
    centred : bool
        Whether the lanes lie on both sides of that line.
    lanes : tuple of NetworkLane
        Lanes from the kerb.
    """

    id: str
    from_node: str
    to_node: str
    name: str
    function: str
    line: Float | None
    centred: bool
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
    inside : dict of str to NetworkEdge
        Parts of junctions by id.
    nodes, shapes : dict of str to float64, metres
        Positions (2,) of the nodes outside junctions, and outlines (k, 3) of junctions.
    connections : list of dict
        Connections between lanes, as in the file.
    left_hand : bool
        Whether traffic keeps to the left.
    offset, projection
        Offset (2,) in metres that was added to projected coordinates, and the projection in the notation of PROJ.
    """

    edges: dict[str, NetworkEdge]
    turns: dict[str, list[tuple[str, str]]]
    signalised: dict[str, Float]
    inside: dict[str, NetworkEdge]
    nodes: dict[str, Float]
    shapes: dict[str, Float]
    connections: list[Attributes]
    left_hand: bool
    offset: Float
    projection: str

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

    def lane(self, number: str) -> NetworkLane:
        """Return a lane by its id: that of its edge, and its number there."""
        edge, _, index = number.rpartition("_")
        return (self.inside if edge in self.inside else self.edges)[edge].lanes[int(index)]


def read_network(path: str | os.PathLike[str]) -> StreetNetwork:
    """Read a SUMO network.

    Raises
    ------
    SeipError
        The file cannot be read, is not a SUMO network, or has lanes with lengths or coordinates out of their limits.
    """
    reader = _Reader(Path(path).name)
    finish(read_tags(path, reader.read_element))
    if not reader.network.edges:
        raise SeipError(f"{reader.name} is not a SUMO network (it has no edges): choose a .net.xml file")
    return reader.network


class _Reader:
    """Handler of a stream of XML that collects the elements of a network."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.network = StreetNetwork({}, {}, {}, {}, {}, {}, [], left_hand=False, offset=np.zeros(2), projection="")
        self._current = ""  # edge of the lanes that follow in the stream

    def read_element(self, tag: str, attributes: Attributes) -> None:
        """Read an element; an error names the file and the element."""
        read = getattr(self, f"_{tag}", None) if tag in _ELEMENTS else None
        if read is None:
            return
        try:
            read(attributes)
        except (KeyError, IndexError, ValueError) as error:
            fault = f"the attribute {error} is missing" if isinstance(error, KeyError) else str(error)
            raise SeipError(
                f"{self.name} is not a valid SUMO network: <{tag}> {_named(attributes)}: {fault}; "
                "write the network again with netconvert"
            ) from error

    def _net(self, attributes: Attributes) -> None:
        self.network = replace(self.network, left_hand=attributes.get("lefthand") == "true")

    def _location(self, attributes: Attributes) -> None:
        offset = np.array(attributes["netOffset"].split(","), dtype=np.float64)
        self.network = replace(self.network, offset=offset, projection=attributes.get("projParameter", ""))

    def _edge(self, attributes: Attributes) -> None:
        number, function = attributes["id"], attributes.get("function", "")
        begin, end = (attributes.get(key, "") if function else attributes[key] for key in ("from", "to"))
        # netconvert escapes the names of streets twice: "Smith & Sons" arrives as "Smith &amp; Sons".
        name = unescape(attributes.get("name", ""), _QUOTES)
        line = shape_points(attributes["shape"]) if "shape" in attributes else None
        centred = attributes.get("spreadType") == "center"
        self._current = number
        edges = self.network.inside if function else self.network.edges
        edges[number] = NetworkEdge(number, begin, end, name, function, line, centred, ())

    def _lane(self, attributes: Attributes) -> None:
        inside = self.network.inside
        edges = inside if self._current in inside else self.network.edges
        edge = edges[self._current]
        lane = _lane(attributes, CROSSING_WIDTH if edge.function == "crossing" else LANE_WIDTH)
        edges[self._current] = replace(edge, lanes=(*edge.lanes, lane))

    def _connection(self, attributes: Attributes) -> None:
        begin, edges = attributes["from"], self.network.edges
        self.network.connections.append(attributes)
        if begin not in edges:
            return
        turn, lane = (attributes["to"], attributes["dir"].lower()), int(attributes["fromLane"])
        lanes = edges[begin].lanes
        if not 0 <= lane < len(lanes):
            raise ValueError(f"fromLane is {lane}, but the edge has {counted(len(lanes), 'lane')}")
        turns = self.network.turns.setdefault(begin, [])
        # A lane also for pedestrians has connections to crossings, which are not edges for vehicles. Partly left
        # and partly right (L, R) count as left and right; turnarounds (t) are left out, as the demand has no share of
        # them.
        is_turn = turn[0] in edges and turn[1] in {"l", "s", "r"}
        if is_turn and lanes[lane].use == DRIVING and turn not in turns:
            turns.append(turn)

    def _junction(self, attributes: Attributes) -> None:
        number, kind = attributes["id"], attributes.get("type", "")
        if kind == "internal":
            return
        position = np.array([float(attributes["x"]), float(attributes["y"])])
        self.network.nodes[number] = _checked(MAP_COORDINATE, "a coordinate", position)
        if kind.startswith("traffic_light"):
            self.network.signalised[number] = position
        if attributes.get("shape"):
            self.network.shapes[number] = shape_points(attributes["shape"])


def _named(attributes: Attributes) -> str:
    """Return the name of an element in a message: its id, or for a connection its edges."""
    if "from" in attributes and "id" not in attributes:
        return f"from {quoted(attributes['from'])} to {quoted(attributes.get('to', ''))}"
    return quoted(attributes.get("id", ""))


def _lane(attributes: Attributes, usual: float) -> NetworkLane:
    points = shape_points(attributes["shape"])
    if len(attributes["shape"].split()) < 2:
        raise ValueError("the shape is not a line of two or more points x,y")
    index = int(attributes["index"])
    if index < 0:
        raise ValueError(f"the index is {index}, not 0 or more")
    length = _checked(ROAD_LENGTH, "the length", np.array(float(attributes["length"])))
    allowed, closed = (frozenset(attributes.get(key, "").split()) for key in ("allow", "disallow"))
    return NetworkLane(index, allowed, closed, float(attributes.get("width", usual)), float(length), points)


def shape_points(shape: str) -> Float:
    """Return the points (n, 3) of a shape, without repeated ones."""
    rows = [[float(value) for value in point.split(",")] for point in shape.split()]
    if any(len(row) < 2 for row in rows):
        raise ValueError("the shape is not a line of two or more points x,y")
    points = _checked(MAP_COORDINATE, "a coordinate", np.array([(*row, 0.0)[:3] for row in rows]))
    steps = np.hypot(*np.diff(points[:, :2], axis=0).T)
    apart: Float = points[np.concatenate([[True], steps > MIN_STEP])]
    return apart


def shape_text(line: Float, precision: int) -> str:
    """Return the shape of a line (n, 3) with a number of decimal places, without heights if all are zero."""
    rows = (line if line[:, 2].any() else line[:, :2]).tolist()
    return " ".join(",".join(f"{value:.{precision}f}" for value in row) for row in rows)


def _checked(limits: Limits, quantity: str, values: Float) -> Float:
    if fault := limits.fault(values):
        raise ValueError(f"{quantity} {fault}")
    return values
