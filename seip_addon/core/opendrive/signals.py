"""Signals of the map in map coordinates."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely import Point
from shapely.geometry.base import BaseGeometry

from .lanes import ground_elevation
from .road_map import Road, RoadMap

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PlacedSignal:
    """A signal where it stands or hangs.

    Maps disagree on what is given, the foot of the post or the lamp above the
    carriageway; ``ground`` helps to tell.

    Parameters
    ----------
    road_id, id, name, kind, subtype : str
        As in the file; ``kind`` is its type.
    dynamic : bool
        Whether it changes, as a traffic light does.
    position : (3,) float64, metres
        In map coordinates.
    yaw : float, radians
        Direction of the traffic that it is meant for, counter-clockwise from +x.
    height, width : float, metres
        Zero where the file says nothing.
    s, t, z_offset : float, metres
        As in the file.
    ground : float, metres
        Elevation of the road surface below, or of its edge beside the road.
    """

    road_id: str
    id: str
    name: str
    kind: str
    subtype: str
    dynamic: bool
    position: Float
    yaw: float
    height: float
    width: float
    s: float
    t: float
    z_offset: float
    ground: float


def placed_signals(road_map: RoadMap, *, area: BaseGeometry | None = None) -> tuple[PlacedSignal, ...]:
    """Return the signals of a map, those in an area of the plan (map coordinates) if one is given."""
    return tuple(
        signal
        for road in road_map.roads
        for signal in _signals(road)
        if area is None or Point(signal.position[:2]).intersects(area)
    )


def _signals(road: Road) -> Iterator[PlacedSignal]:
    for signal in road.signals:
        s, t = np.array([signal.s]), np.array([signal.t])
        position = road.place(s, t)[0] + np.array([0.0, 0.0, signal.z_offset])
        yield PlacedSignal(
            road_id=road.id,
            id=signal.id,
            name=signal.name,
            kind=signal.kind,
            subtype=signal.subtype,
            dynamic=signal.dynamic,
            position=position,
            yaw=float(road.frame(s).heading[0]) + signal.heading,
            height=signal.height,
            width=signal.width,
            s=signal.s,
            t=signal.t,
            z_offset=signal.z_offset,
            ground=ground_elevation(road, signal.s, signal.t),
        )
