"""Plan of the streets of a map or an extract, on which a user chooses a junction."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ..base.arrays import Float, Integer
from ..geometry.tangent_plane import plan_metres
from .opendrive.lanes import LaneSurface
from .opendrive.road_map import Junction, RoadMap
from .openstreetmap.crossings import Crossing
from .openstreetmap.extract import Extract
from .openstreetmap.streets import importance, is_street

LABEL_SPACING = 150.0  # metres between places along a street at which its name may stand
CHORD = 30.0  # metres to each side of such a place that its direction is taken from
STEP = 5.0  # metres between two points of the line of a road
MAIN_LANES = 4  # driving lanes from which a road is a main street


@dataclass(frozen=True, eq=False)
class PlanStreet:
    """A street, or a piece of one.

    Parameters
    ----------
    line : (n, 2) float64, metres
        Centre line.
    importance : int
        2 for a main street, 1 for a larger one, otherwise 0.
    """

    line: Float
    importance: int


@dataclass(frozen=True, eq=False)
class NamePlaces:
    """Places along streets at which their names may stand.

    Parameters
    ----------
    names : tuple of str
        Names of the streets, in alphabetical order.
    street : (n,) int64
        Street of each place, an index into ``names``.
    positions : (n, 2) float64, metres
    angles : (n,) float64, radians
        Direction of the street, counter-clockwise from east, from -π/2 to π/2.
    lengths : (n,) float64, metres
        Length of the unbranched piece of the street.
    importance : (n,) int64
        2 for a main street, 1 for a larger one, otherwise 0.
    """

    names: tuple[str, ...]
    street: Integer
    positions: Float
    angles: Float
    lengths: Float
    importance: Integer


@dataclass(frozen=True, eq=False)
class StreetPlan:
    """The streets of a map in plan: x east and y north, in metres from a place in their middle.

    Parameters
    ----------
    streets : tuple of PlanStreet
    junctions : (n, 2) float64, metres
        Junctions, or crossings of named streets.
    importance : (n,) int64
        Importance of each, from 0 to 2.
    names : NamePlaces
    attribution : str
        Credit required by the data; may be empty.
    """

    streets: tuple[PlanStreet, ...]
    junctions: Float
    importance: Integer
    names: NamePlaces
    attribution: str


def plan_of_extract(extract: Extract, crossings: Sequence[Crossing]) -> StreetPlan:
    """Return the streets of an extract in plan, with the given crossings in their order.

    Within 10 km of the middle, distances are right to 0.2 %.
    """
    streets = [way for way in extract.ways.values() if is_street(way.tags)]
    degrees = [
        np.array([(node.latitude, node.longitude) for node in extract.line(way)], dtype=np.float64).reshape(-1, 2)
        for way in streets
    ]
    at = np.array([(one.latitude, one.longitude) for one in crossings], dtype=np.float64).reshape(-1, 2)
    bounds = at if len(at) else np.concatenate([at, *degrees])
    middle = _middle(bounds) if len(bounds) else np.zeros(2)
    drawn = (
        (PlanStreet(plan_metres(line, middle), importance(way.tags)), way.tags.get("name", ""))
        for way, line in zip(streets, degrees, strict=True)
        if len(line) > 1  # otherwise the extract has at most one of its nodes
    )
    return _plan(drawn, plan_metres(at, middle), [one.importance for one in crossings], extract.attribution)


def plan_of_map(road_map: RoadMap, lanes: Sequence[LaneSurface], junctions: Sequence[Junction]) -> StreetPlan:
    """Return the roads of an OpenDRIVE map in plan, with the given junctions in their order.

    Parameters
    ----------
    lanes : sequence of LaneSurface
        Lanes of all roads of the map.
    junctions : sequence of Junction
        Junctions with roads.
    """
    stations = (np.linspace(0.0, road.length, 2 + int(road.length / STEP)) for road in road_map.roads)
    lines = [road.frame(along).origin[:, :2] for road, along in zip(road_map.roads, stations, strict=True)]
    within = defaultdict(list)
    for road, line in zip(road_map.roads, lines, strict=True):
        within[road.junction_id].append(line)
    at = np.array([_middle(np.concatenate(within[one.id])) for one in junctions]).reshape(-1, 2)
    middle = _middle(at if len(at) else np.concatenate(lines))
    driving = {(lane.road_id, lane.lane_id) for lane in lanes if lane.lane_type == "driving"}
    width = Counter(road for road, _ in driving)
    arms = Counter(
        link.id
        for road in road_map.roads
        for link in (road.predecessor, road.successor)
        if road.junction_id is None and link is not None and link.kind == "junction"
    )
    drawn = (
        (
            PlanStreet(line - middle, 2 if width[road.id] >= MAIN_LANES else int(width[road.id] > 1)),
            road.name if road.junction_id is None else "",
        )
        for road, line in zip(road_map.roads, lines, strict=True)
    )
    return _plan(drawn, at - middle, [min(2, max(0, arms[one.id] - 2)) for one in junctions], "")


def _plan(
    drawn: Iterable[tuple[PlanStreet, str]], junctions: Float, importance: Sequence[int], attribution: str
) -> StreetPlan:
    """Return a plan of streets with their names, "" for none, and of junctions (n, 2) with the importance of each."""
    streets, named = [], defaultdict(list)
    for street, name in drawn:
        streets.append(street)
        if name:
            named[name].append(street)
    return StreetPlan(tuple(streets), junctions, np.array(importance, dtype=np.int64), _name_places(named), attribution)


def _middle(points: Float) -> Float:
    middle: Float = (points.min(axis=0) + points.max(axis=0)) / 2.0
    return middle


def _name_places(named: Mapping[str, Sequence[PlanStreet]]) -> NamePlaces:
    """Return places for the names of streets; pieces that continue each other are one."""
    names = tuple(sorted(named))
    rows = [(number, *place) for number, name in enumerate(names) for place in _places_along(named[name])]
    table = np.array(rows, dtype=np.float64).reshape(-1, 6)
    return NamePlaces(
        names, table[:, 0].astype(np.int64), table[:, 1:3], table[:, 3], table[:, 4], table[:, 5].astype(np.int64)
    )


def _places_along(pieces: Sequence[PlanStreet]) -> Iterator[tuple[float, float, float, float, int]]:
    """Yield x, y, angle, length and importance for places along the pieces of one street."""
    most = max(one.importance for one in pieces)
    merged = shapely.line_merge(shapely.multilinestrings([shapely.linestrings(one.line) for one in pieces]))
    for line in shapely.get_parts(merged):
        length = float(line.length)
        if length <= 0.0:
            continue
        count = max(1, round(length / LABEL_SPACING))
        along = (np.arange(count) + 0.5) * (length / count)
        here, before, after = (
            shapely.get_coordinates(shapely.line_interpolate_point(line, np.clip(along + step, 0.0, length)))
            for step in (0.0, -CHORD, CHORD)
        )
        east, north = (after - before).T
        upside_down = (east < 0.0) | ((east == 0.0) & (north < 0.0))
        angles = np.arctan2(np.where(upside_down, -north, north), np.abs(east))
        for (x, y), angle in zip(here.tolist(), angles.tolist(), strict=True):
            yield x, y, angle, length, most
