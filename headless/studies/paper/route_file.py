"""Demand of a user's route file for SUMO: its flows, drawn randomly for each run."""

import math
import os
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Progress
from seip_addon.core.storage.files import whole_file
from seip_addon.core.storage.xml_stream import Attributes, quoted, read_tags
from seip_addon.core.world.traffic_simulation.demand import poisson_departures

DEFAULT_CLASS = "passenger"  # SUMO's vClass of a vehicle whose flow names no type
MIN_GAP = (1.0, 4.0)  # metres to the vehicle in front; on average SUMO's 2.5
STOP_LINE_GAP = (0.2, 4.0)  # metres to the stop line
_DEPARTURE = ("departLane", "departPos", "departSpeed", "arrivalLane", "arrivalPos", "arrivalSpeed")


@dataclass(frozen=True)
class Flow:
    """A flow of vehicles along one route.

    Parameters
    ----------
    rate : float, vehicles per hour
    edges : tuple of str
        Edges of the network, in driving order.
    type : str
        Type of its vehicles, or "" if the file names none.
    departure : tuple of (str, str)
        Further attributes of each vehicle, for SUMO.
    """

    name: str
    rate: float
    edges: tuple[str, ...]
    type: str
    departure: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class RouteDemand:
    """Flows of a route file, and the vehicle types of all files.

    Parameters
    ----------
    types : dict of str to dict
        Attributes of each vehicle type, by its id.
    models : tuple of str
        Types for flows without a type: those of `DEFAULT_CLASS` in the files of types.
    """

    flows: tuple[Flow, ...]
    types: dict[str, Attributes]
    models: tuple[str, ...]

    @property
    def rate(self) -> float:
        """Vehicles per hour of all flows."""
        return math.fsum(flow.rate for flow in self.flows)


def read_demand(routes: Path, types: Sequence[Path] = ()) -> Generator[Progress, None, RouteDemand]:
    """Read the flows of a route file, and vehicle types from it and from further files.

    Raises
    ------
    SeipError
        A file cannot be read, or the flows cannot be drawn randomly: there are none, or one has no route, no rate, a
        type that no file describes, or does not begin at 0.
    """
    reader = _Reader()
    for path in types:
        yield from read_tags(path, reader.take, reader.leave)
    known = reader.types
    models = tuple(name for name, one in known.items() if one.get("vClass", DEFAULT_CLASS) == DEFAULT_CLASS)
    if types and not models:
        raise SeipError(
            f"{types[0].name} has no vehicle type of class {DEFAULT_CLASS}, which flows without a type need: add one"
        )
    reader.flows.clear()  # flows in the files of types are ignored
    yield from read_tags(routes, reader.take, reader.leave)
    if not reader.flows:
        raise SeipError(f"{routes.name} has no flow: name a route file of SUMO with flows")
    return RouteDemand(tuple(_flow(one, reader.ways, known, routes.name) for one in reader.flows), known, models)


class _Reader:
    """Handler of a stream of XML that collects the attributes of vehicle types and flows, and the routes."""

    def __init__(self) -> None:
        self.types: dict[str, Attributes] = {}
        self.ways: dict[str, tuple[str, ...]] = {}
        self.flows: list[Attributes] = []
        self._in_flow = False

    def take(self, tag: str, attributes: Attributes) -> None:
        if tag == "vType":
            self.types[attributes.get("id", "")] = attributes
        elif tag == "flow":
            self.flows.append(dict(attributes))
            self._in_flow = True
        elif tag == "route" and self._in_flow:
            self.flows[-1]["edges"] = attributes.get("edges", "")
        elif tag == "route":
            self.ways[attributes.get("id", "")] = tuple(attributes.get("edges", "").split())

    def leave(self, tag: str) -> None:
        self._in_flow = self._in_flow and tag != "flow"


def _flow(given: Attributes, ways: dict[str, tuple[str, ...]], known: dict[str, Attributes], file: str) -> Flow:
    name = given.get("id", "")
    called = f"{file}: flow {quoted(name)}"
    edges = tuple(given["edges"].split()) if "edges" in given else ways.get(given.get("route", ""), ())
    if not edges:
        raise SeipError(f"{called} has no route of edges in this file: give it one")
    kind = given.get("type", "")
    if kind and kind not in known:
        raise SeipError(f"{called} is of type {quoted(kind)}, which no file describes: name its file with --types")
    if _number(given.get("begin", "0")) != 0.0:
        raise SeipError(
            f"{called} does not begin at 0: demand that changes with time is not supported; let it begin at 0"
        )
    departure = tuple((key, given[key]) for key in _DEPARTURE if key in given)
    return Flow(name, _rate(given, called), edges, kind, departure)


def _rate(given: Attributes, called: str) -> float:
    """Return the vehicles per hour of a flow, from any of SUMO's attributes for it."""
    period = given.get("period", "")
    if period.startswith("exp(") and period.endswith(")"):
        rate = 3600.0 * _number(period[4:-1])
    elif period:
        seconds = _number(period)
        rate = 3600.0 / seconds if seconds else math.nan
    elif "probability" in given:
        rate = 3600.0 * _number(given["probability"])
    else:
        rate = _number(given.get("vehsPerHour", given.get("perHour", "")))
    if not 0.0 < rate <= 10_000.0:
        raise SeipError(
            f"{called} has no rate above 0 and up to 10,000 vehicles per hour: give it vehsPerHour, period or "
            "probability"
        )
    return rate


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def write_run(path: str | os.PathLike[str], demand: RouteDemand, seed: int, duration: float) -> None:
    """Write a route file of single vehicles from 0 to ``duration`` seconds; the same for the same seed.

    Departures are a Poisson process of the demand's rate. Each vehicle is assigned to a flow with a probability
    proportional to the flow's rate. Lane, model and stopping gaps are random unless the files give them. The seed is
    part of all names because the paint of a road user depends on its name.
    """
    random = np.random.default_rng([seed, 4])
    shares = np.array([flow.rate for flow in demand.flows]) / demand.rate
    lines = ["<routes>"]
    for number, depart in enumerate(poisson_departures(demand.rate, random, duration)):
        flow = demand.flows[int(random.choice(len(shares), p=shares))]
        name = f"{flow.name}{seed}.{number}"
        model = flow.type or (str(random.choice(demand.models)) if demand.models else "")
        gaps = {"minGap": _between(random, MIN_GAP), "jmStoplineGap": _between(random, STOP_LINE_GAP)}
        lines.append(_element("vType", gaps | demand.types.get(model, {}) | {"id": name}))
        vehicle = {"id": name, "type": name, "depart": f"{depart:.1f}", "departLane": "random"} | dict(flow.departure)
        route = _element("route", {"edges": " ".join(flow.edges)})
        lines.append(f"{_element('vehicle', vehicle)[:-2]}>{route}</vehicle>")
    with whole_file(path) as temporary:
        temporary.write_text("\n".join([*lines, "</routes>", ""]), encoding="utf-8")


def _between(random: np.random.Generator, span: tuple[float, float]) -> str:
    return f"{random.uniform(*span):.2f}"


def _element(tag: str, attributes: Attributes) -> str:
    return f"<{tag} {' '.join(f'{key}={quoteattr(value)}' for key, value in attributes.items())}/>"
