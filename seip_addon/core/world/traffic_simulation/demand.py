"""Traffic demand, departures and routes of vehicles and pedestrians, as a route file for SUMO."""

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...base.errors import SeipError
from ...base.settings import setting
from ...storage.files import whole_file
from .street_network import DRIVING, PARKED_CLASS, PARKING, WALKING, NetworkEdge, NetworkLane, StreetNetwork

MAX_FLOW = 3000.0  # vehicles, or persons, per hour and arm
_MAX_ROUTE_EDGES = 40  # edges; after these, a vehicle leaves a network without ends
_MAX_WALK = 150.0  # metres in plan from one pavement to another
_MIN_PAVEMENT = 20.0  # metres; no pedestrians start on a shorter one
_DELIVERY_SHARE = 0.35  # of the vans and trucks; they stop once on their way
_STOP_SECONDS = (20.0, 60.0)  # seconds
_PARKED_GAP = 0.5  # least metres between parked cars
_BAY_LENGTH = 6.5  # metres of kerb for a parked car
MAX_PARKED_LENGTH = _BAY_LENGTH - _PARKED_GAP  # metres
PARKED = "parked_"  # begins the types of parked vehicles
_OCCUPIED_SHARE = 0.6  # of the bays in parking lanes
_FIRST_BAY = 35.0  # metres from the start of the street
_ROWS_ALONG = 2  # positions for a row of cars along the kerb of a street, one behind the other
# Shift of the bays from seed to seed, as a share of a bay. Four successive seeds are 1.4 m or more apart (0.22 bays
# of 6.5 m), so that a detector tested on one of them does not find parked cars where it was trained on them. After
# many seeds, all positions have been used.
_SHIFT = 0.26
_PARKING_SECONDS = 1e6  # seconds
VEHICLE_SHARES = {"car": 0.58, "van": 0.13, "truck": 0.10, "bus": 0.06, "motorcycle": 0.07, "bicycle": 0.06}
"""Shares of the vehicles that enter on each arm."""


class RoadUserModel(NamedTuple):
    """A model of road user: its vClass, guiShape, size in metres, share within its category, and top speed in m/s."""

    v_class: str
    shape: str
    length: float
    width: float
    height: float
    share: float
    speed: float = 30.0


MODELS = {
    "car": {
        "city_car": RoadUserModel("passenger", "passenger/hatchback", 3.57, 1.63, 1.49, 0.12),
        "supermini": RoadUserModel("passenger", "passenger/hatchback", 4.06, 1.75, 1.45, 0.22),
        "compact": RoadUserModel("passenger", "passenger/hatchback", 4.28, 1.79, 1.48, 0.22),
        "estate": RoadUserModel("passenger", "passenger/wagon", 4.69, 1.83, 1.52, 0.12),
        "saloon": RoadUserModel("passenger", "passenger/sedan", 4.87, 1.86, 1.45, 0.12),
        "crossover": RoadUserModel("passenger", "passenger", 4.48, 1.84, 1.64, 0.14),
        "large_suv": RoadUserModel("passenger", "passenger", 4.93, 1.98, 1.77, 0.06),
    },
    "van": {
        "small_van": RoadUserModel("delivery", "delivery", 4.50, 1.86, 1.84, 0.35),
        "delivery_van": RoadUserModel("delivery", "delivery", 5.93, 2.02, 2.62, 0.45),
        "long_van": RoadUserModel("delivery", "delivery", 6.94, 2.04, 2.79, 0.20),
    },
    "truck": {
        "box_truck": RoadUserModel("truck", "truck", 7.60, 2.45, 3.35, 0.6, 22.0),
        "large_truck": RoadUserModel("truck", "truck", 9.60, 2.55, 3.75, 0.4, 22.0),
    },
    "bus": {
        "midibus": RoadUserModel("bus", "bus", 9.50, 2.45, 3.00, 0.3, 18.0),
        "city_bus": RoadUserModel("bus", "bus", 12.00, 2.55, 3.10, 0.7, 18.0),
    },
    "motorcycle": {
        "scooter": RoadUserModel("motorcycle", "moped", 1.92, 0.74, 1.68, 0.5, 16.0),
        "motorcycle": RoadUserModel("motorcycle", "motorcycle", 2.17, 0.83, 1.62, 0.5),
    },
    "bicycle": {
        "city_bicycle": RoadUserModel("bicycle", "bicycle", 1.82, 0.62, 1.78, 0.7, 5.5),
        "cargo_bicycle": RoadUserModel("bicycle", "bicycle", 2.50, 0.70, 1.75, 0.3, 4.8),
    },
    "pedestrian": {
        "adult": RoadUserModel("pedestrian", "pedestrian", 0.45, 0.55, 1.70, 0.6, 1.4),
        "tall_adult": RoadUserModel("pedestrian", "pedestrian", 0.48, 0.60, 1.84, 0.25, 1.5),
        "child": RoadUserModel("pedestrian", "pedestrian", 0.35, 0.42, 1.28, 0.15, 1.2),
    },
}
"""Sizes of road users in European cities, riders included; after makers' data sheets, rounded."""


Bay = tuple[NetworkEdge, NetworkLane, float]
"""Street, lane and middle (metres along it) of a parked car."""


class Departure(NamedTuple):
    """Departure of a road user: time (seconds), id, type, and text in the route file, with ``{type}`` for the type."""

    depart: float
    name: str
    type: str
    text: str


@dataclass(frozen=True)
class Demand:
    """Traffic volumes by kind of road user.

    Parameters
    ----------
    flow : float, vehicles per hour
        Vehicles that enter on each arm.
    turns : (3,) float
        Shares that turn left, go straight on and turn right, if a junction offers the movement.
    pedestrians : float, persons per hour
        Pedestrians that start, per arm of the network.
    shares : mapping of str to float
        Shares of the vehicles by category.
    """

    flow: float = setting(600.0, "vehicles per hour and arm", maximum=MAX_FLOW, metavar="N")
    turns: tuple[float, float, float] = (0.2, 0.6, 0.2)
    pedestrians: float = setting(200.0, "persons per hour and arm", minimum=0.0, maximum=MAX_FLOW, metavar="N")
    shares: Mapping[str, float] = field(default_factory=VEHICLE_SHARES.copy)

    def __post_init__(self) -> None:
        if not 0.0 < self.flow <= MAX_FLOW:
            raise SeipError(
                f"--flow must be above 0 and at most {MAX_FLOW:g} vehicles per hour and arm, not {self.flow:g}"
            )
        if not 0.0 <= self.pedestrians <= MAX_FLOW:
            raise SeipError(f"--pedestrians must be 0 to {MAX_FLOW:g} per hour and arm, not {self.pedestrians:g}")
        if min(self.turns) < 0.0 or not 0.0 < sum(self.turns) < np.inf:
            raise SeipError(f"--turns must be three shares of which one is above 0, not {self.turns}")
        given = self.shares.values()
        if not self.shares.keys() <= VEHICLE_SHARES.keys() or min(given, default=0.0) < 0.0 or not sum(given):
            raise SeipError(
                f"shares of vehicles must be for {', '.join(VEHICLE_SHARES)}, with one above 0, not {self.shares}"
            )

    def own_types(self, departures: Sequence[Departure], seed: int) -> Mapping[str, str]:  # noqa: ARG002
        """Return types of single road users, as elements of `type_line` by the name of the departure.

        By default there are none, and each road user has the type of its model.
        """
        return {}

    def kerb_bays(self, network: StreetNetwork, seed: int, random: np.random.Generator) -> Iterator[Bay]:  # noqa: ARG002
        """Return the bays with parked cars at kerbs, used if no street has parking lanes."""
        return rows_at_kerbs(network, seed)


def write_routes(
    path: str | os.PathLike[str], network: StreetNetwork, demand: Demand, seed: int, duration: float
) -> None:
    """Write the routes of all road users from 0 to ``duration`` seconds; the same for the same seed.

    Departures, routes, vehicles and parked cars are drawn independently for each seed. The seed is part of all names
    because the paint of a road user depends on its name.

    Raises
    ------
    SeipError
        The network has no arm on which vehicles can enter.
    """
    arms = network.arms
    if not arms:
        raise SeipError(
            "no road leads into the map from outside, so no traffic can enter: use a scene whose border cuts a road"
        )
    # Parking, each arm, pedestrians and sizes have random streams of their own: changing the demand of one of them
    # does not change the draws of the others.
    random = np.random.default_rng([seed, 0])
    bays = _bays(network, demand, seed, random)
    entries = list(_parked(bays, seed, random))
    # Deliveries stop in the outer lane: not on streets where parked cars stand in it.
    free = set(network.edges) - {edge.id for edge, lane, _ in bays if lane.use == DRIVING}
    for number, arm in enumerate(arms, start=1):
        random = np.random.default_rng([seed, 1, number])
        for depart in poisson_departures(demand.flow, random, duration):
            route = _route(network, arm, demand.turns, random)
            entries.append(_vehicle(f"{seed}.{arm.id}.{len(entries)}", depart, route, demand.shares, free, random))
    entries += _walkers(network, demand.pedestrians * len(arms), seed, duration)
    entries.sort(key=lambda entry: entry.depart)
    own = demand.own_types(entries, seed)
    texts = (entry.text.format(type=entry.name if entry.name in own else entry.type) for entry in entries)
    lines = ["<routes>", *_type_lines(), *own.values(), *texts, "</routes>"]
    with whole_file(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _type_lines() -> Iterator[str]:
    for models in MODELS.values():
        for name, model in models.items():
            yield type_line(name, model)
            if model.v_class in ("passenger", "delivery"):
                yield type_line(f"{PARKED}{name}", model, parked=True)


def type_line(name: str, model: RoadUserModel, *, parked: bool = False) -> str:
    """Return the type of a model, or of a parked vehicle of it, as an element of a route file."""
    length, width, height = model.length, model.width, model.height
    if parked:
        v_class, more = PARKED_CLASS, f' minGap="{_PARKED_GAP}"'
    else:
        v_class = model.v_class
        more = "" if v_class == "pedestrian" else ' jmStoplineGap="1.5" lcKeepRight="0"'
    return (
        f'<vType id="{name}" vClass="{v_class}" guiShape="{model.shape}" length="{length}" width="{width}" '
        f'height="{height}" maxSpeed="{model.speed}"{more}/>'
    )


def _pick(models: dict[str, RoadUserModel], random: np.random.Generator) -> str:
    shares = np.array([model.share for model in models.values()])
    return str(random.choice(list(models), p=shares / shares.sum()))


def poisson_departures(rate: float, random: np.random.Generator, duration: float) -> Iterator[float]:
    """Yield the times of a Poisson process, ``rate`` per hour."""
    time = 0.0
    while rate > 0.0:
        time += float(random.exponential(3600.0 / rate))
        if time >= duration:
            return
        yield round(time, 1)


def _vehicle(
    number: str,
    depart: float,
    route: list[NetworkEdge],
    share_of: Mapping[str, float],
    free: set[str],
    random: np.random.Generator,
) -> Departure:
    categories, shares = list(share_of), np.array(list(share_of.values()))
    category = str(random.choice(categories, p=shares / shares.sum()))
    delivers = category in {"van", "truck"} and random.random() < _DELIVERY_SHARE
    stop = _delivery([edge for edge in route if edge.id in free], random) if delivers else ""
    edges = " ".join(edge.id for edge in route)
    return Departure(
        depart,
        f"{category}-{number}",
        _pick(MODELS[category], random),
        f'<vehicle id="{category}-{number}" type="{{type}}" depart="{depart}" '
        f'departLane="best" departSpeed="max"><route edges="{edges}"/>{stop}</vehicle>',
    )


def _route(
    network: StreetNetwork, arm: NetworkEdge, turns: tuple[float, float, float], random: np.random.Generator
) -> list[NetworkEdge]:
    """Return a random route through the network; at each junction, the shares of the offered movements apply."""
    share = dict(zip("lsr", turns, strict=True))
    route = [arm]
    while network.has_next_edge(route[-1]) and len(route) < _MAX_ROUTE_EDGES:
        ways = network.turns[route[-1].id]
        # Shares apply to the movements that this junction offers; if none of them has a share, all are equally likely.
        weights = np.array([share[way] for _, way in ways])
        if not weights.any():
            weights = np.ones(len(ways))
        route.append(network.edges[ways[int(random.choice(len(ways), p=weights / weights.sum()))][0]])
    return route


def _delivery(streets: list[NetworkEdge], random: np.random.Generator) -> str:
    """Return a stop in the outer lane of a street with another lane for passing, or "" if there is none."""
    streets = [edge for edge in streets if len(edge.lanes_for(DRIVING)) > 1 and edge.lanes[0].length > 2.0 * _FIRST_BAY]
    if not streets:
        return ""
    edge = streets[int(random.integers(len(streets)))]
    lane = edge.lanes_for(DRIVING)[0]
    place = float(random.uniform(_FIRST_BAY, lane.length - _FIRST_BAY))
    return f'<stop lane="{edge.id}_{lane.index}" endPos="{place:.1f}" duration="{random.uniform(*_STOP_SECONDS):.0f}"/>'


def _bays(network: StreetNetwork, demand: Demand, seed: int, random: np.random.Generator) -> list[Bay]:
    """Return the bays with parked cars: in parking lanes, otherwise in rows at the kerb.

    Bays are not marked on the road. Those of one seed lie between those of the others, so that parked cars stand at
    different positions.
    """
    shift = _BAY_LENGTH * (seed * _SHIFT % 1.0)
    bays = [
        (edge, lane, float(place))
        for edge in network.edges.values()
        for lane in edge.lanes_for(PARKING)
        for place in np.arange(_BAY_LENGTH + shift, lane.length - _BAY_LENGTH / 2.0 - 1.0, _BAY_LENGTH)
        if random.random() < _OCCUPIED_SHARE
    ]
    if bays:
        return bays
    return [bay for bay in demand.kerb_bays(network, seed, random) if bay[2] < bay[1].length - _BAY_LENGTH]


def _parked(bays: list[Bay], seed: int, random: np.random.Generator) -> Iterator[Departure]:
    models = MODELS["car"] | {"small_van": MODELS["van"]["small_van"]}
    for number, (edge, lane, middle) in enumerate(bays):
        model = _pick(models, random)
        front = middle + models[model].length / 2.0
        text = (
            f'<vehicle id="parked-{seed}.{number}" type="{{type}}" depart="0" departLane="{lane.index}" '
            f'departPos="{front:.2f}" departSpeed="0"><route edges="{edge.id}"/>'
            f'<stop lane="{edge.id}_{lane.index}" endPos="{front:.2f}" duration="{_PARKING_SECONDS:.0f}"/></vehicle>'
        )
        yield Departure(0.0, f"parked-{seed}.{number}", f"{PARKED}{model}", text)


def rows_at_kerbs(
    network: StreetNetwork, seed: int, share: float = 0.5, count: int = 3, first: float = _FIRST_BAY
) -> Iterator[Bay]:
    """Yield the bays of rows in the outer of several lanes of streets on which vehicles leave the network.

    Successive seeds use other streets, then positions along them, then a shift.

    Parameters
    ----------
    share : float
        Share of the streets with room for a row that have one.
    count : int
        Number of bays in a row.
    first : float, metres
        Distance from the start of the street to the first bay.
    """
    exits = [
        edge for edge in network.edges.values() if len(edge.lanes_for(DRIVING)) > 1 and not network.has_next_edge(edge)
    ]
    rows = math.ceil(share * len(exits))
    # Rows are numbered over all seeds. The remainder by the number of streets is the street, the quotient counts the
    # rows used there before: first the positions along the kerb, and when all are used, a shift by a part of a bay.
    for number in range(seed * rows, (seed + 1) * rows):
        edge = exits[number % len(exits)]
        lane = edge.lanes_for(DRIVING)[0]
        along, turn = number // len(exits) % _ROWS_ALONG, number // len(exits) // _ROWS_ALONG
        start = first + _BAY_LENGTH * (along * count + turn * _SHIFT % 1.0)
        for place in start + _BAY_LENGTH * np.arange(count):
            yield edge, lane, float(place)


def _walkers(network: StreetNetwork, rate: float, seed: int, duration: float) -> Iterator[Departure]:
    random = np.random.default_rng([seed, 2])
    pavements = [
        (edge, lane)
        for edge in network.edges.values()
        for lane in edge.lanes_for(WALKING)
        if lane.length > _MIN_PAVEMENT
    ]
    if len(pavements) < 2:
        return
    length = np.array([lane.length for _, lane in pavements])
    middle = np.array([lane.line.mean(axis=0) for _, lane in pavements])
    for number, depart in enumerate(poisson_departures(rate, random, duration)):
        # Longer pavements have more starts; a pedestrian walks to any pavement that is near enough.
        start = int(random.choice(len(pavements), p=length / length.sum()))
        within = np.hypot(*(middle - middle[start]).T) < _MAX_WALK
        within[start] = False
        if not within.any():
            continue
        goal = int(random.choice(np.flatnonzero(within)))
        (origin, first), (target, last) = pavements[start], pavements[goal]
        begin, end = random.uniform(2.0, first.length - 2.0), random.uniform(2.0, last.length - 2.0)
        yield Departure(
            depart,
            f"pedestrian-{seed}.{number}",
            _pick(MODELS["pedestrian"], random),
            f'<person id="pedestrian-{seed}.{number}" type="{{type}}" depart="{depart}" '
            f'departPos="{begin:.1f}"><walk from="{origin.id}" to="{target.id}" arrivalPos="{end:.1f}"/></person>',
        )
