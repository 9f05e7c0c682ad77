"""Roads and junctions of an OpenDRIVE map in plan, for a map on which a user chooses a junction."""

from collections import Counter, defaultdict
from collections.abc import Sequence

import numpy as np

from ...arrays import Float
from ..street_plan import PlanStreet, StreetPlan, name_places
from .lanes import LaneSurface
from .road_map import Junction, RoadMap

STEP = 5.0  # metres between two points of a line
MAIN_LANES = 4  # driving lanes from which a road is a main street


def street_plan(road_map: RoadMap, lanes: Sequence[LaneSurface], junctions: Sequence[Junction]) -> StreetPlan:
    """Return the roads of a map in plan, with the given junctions in their order.

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
    drawn, named = [], defaultdict(list)
    for road, line in zip(road_map.roads, lines, strict=True):
        is_main, is_two_way = width[road.id] >= MAIN_LANES, width[road.id] > 1
        drawn.append(PlanStreet(line - middle, 2 if is_main else int(is_two_way)))
        if road.name and road.junction_id is None:
            named[road.name].append(drawn[-1])
    importance = [min(2, max(0, arms[one.id] - 2)) for one in junctions]
    return StreetPlan(tuple(drawn), at - middle, np.array(importance, dtype=np.int64), name_places(named), "")


def _middle(points: Float) -> Float:
    middle: Float = (points.min(axis=0) + points.max(axis=0)) / 2.0
    return middle
