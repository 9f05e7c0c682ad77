"""Signals of the map in map coordinates."""

from dataclasses import dataclass

import numpy as np

from ...arrays import Float
from ...errors import SeipError
from .road_map import Road, RoadMap, RoadSignal


@dataclass(frozen=True, eq=False)
class PlacedSignal:
    """A signal in map coordinates.

    Depending on the map this is the foot of the post or the lamp above the carriageway.

    Parameters
    ----------
    road_id : str
        Road of its position, which may differ from the road that it applies to; if the position is given in map
        coordinates, the road that it applies to.
    id, name, kind : str
        Id, name and type as in the file.
    dynamic : bool
        Whether it changes, as a traffic light does.
    position : (3,) float64, metres
        Position in map coordinates.
    yaw : float, radians
        Direction of the controlled traffic by the standard, counter-clockwise from +x; some exporters give the
        direction that the signal faces.
    """

    road_id: str
    id: str
    name: str
    kind: str
    dynamic: bool
    position: Float
    yaw: float


def placed_signals(road_map: RoadMap) -> tuple[PlacedSignal, ...]:
    """Return the signals of a map.

    Raises
    ------
    SeipError
        A signal stands on a road that the map does not have.
    """
    roads = {road.id: road for road in road_map.roads}
    return tuple(_placed(road, signal, roads) for road in road_map.roads for signal in road.signals)


def _placed(owner: Road, signal: RoadSignal, roads: dict[str, Road]) -> PlacedSignal:
    if signal.road_id not in roads:
        raise SeipError(
            f"road {owner.id}: signal {signal.id} is on road {signal.road_id}, which the map lacks; correct the map"
        )
    if signal.place is not None:
        position, yaw = np.array(signal.place[:3]), signal.place[3]
    else:
        road, s = roads[signal.road_id], np.array([signal.s])
        position = road.place(s, np.array([signal.t]))[0] + np.array([0.0, 0.0, signal.z_offset])
        yaw = float(road.frame(s).heading[0]) + signal.heading
    return PlacedSignal(signal.road_id, signal.id, signal.name, signal.kind, signal.dynamic, position, yaw)
