"""Streets of a map as surfaces: lanes and junctions, from OpenDRIVE or a network of SUMO.

Its use is shown in `tests/core/world/openstreetmap/test_network_map.py`.
"""

from collections.abc import Generator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...base.progress import Progress
from ..opendrive.lanes import LaneSurface, lane_surfaces
from ..opendrive.profile import linear_profile
from ..opendrive.road_map import RoadMap
from .road_surface import with_rows_at

ROADS_PER_STEP = 20
Profiles = Mapping[str, tuple[Float, Float]]
"""Stations (n,) along each road and heights (n,) there, metres, by road id."""


@dataclass(frozen=True, eq=False)
class JunctionArea:
    """Area in plan of a junction, map coordinates.

    Parameters
    ----------
    id : str
        Id of the junction.
    carriageway : shapely geometry
        Area for vehicles.
    walking : shapely geometry
        Pavement between the arms.
    roads : frozenset of str
        Ids of the roads within it and of those that meet there.
    is_joint : bool
        Whether a street only continues there, with other lanes or a different width.
    """

    id: str
    carriageway: BaseGeometry
    walking: BaseGeometry
    roads: frozenset[str]
    is_joint: bool


@dataclass(frozen=True, eq=False)
class StreetMap:
    """A map with the surfaces of its lanes, in map coordinates.

    Parameters
    ----------
    road_map : RoadMap
        Roads with their names and links, objects and traffic lights; roads of a network have no lane sections.
    lanes : tuple of LaneSurface
        Lanes of all roads.
    junctions : tuple of JunctionArea
        Areas of the junctions of a network; empty for OpenDRIVE, whose junctions are the lanes in them.
    """

    road_map: RoadMap
    lanes: tuple[LaneSurface, ...]
    junctions: tuple[JunctionArea, ...] = ()

    def raised(self, profiles: Profiles) -> "StreetMap":
        """Return the streets with new heights of the roads, linear between the given stations."""
        roads = (
            replace(road, elevation=linear_profile(*profiles[road.id])) if road.id in profiles else road
            for road in self.road_map.roads
        )
        lanes = (_raised(lane, *profiles[lane.road_id]) if lane.road_id in profiles else lane for lane in self.lanes)
        return replace(self, road_map=replace(self.road_map, roads=tuple(roads)), lanes=tuple(lanes))


def opendrive_streets(road_map: RoadMap) -> Generator[Progress, None, StreetMap]:
    """Return the streets of an OpenDRIVE map.

    Yields
    ------
    Progress
        Number of roads converted to lanes.

    Raises
    ------
    SeipError
        A road of the map is invalid.
    """
    lanes: list[LaneSurface] = []
    for number, road in enumerate(road_map.roads):
        if number % ROADS_PER_STEP == 0:
            yield Progress(number, len(road_map.roads), "roads")
        lanes += lane_surfaces(road)
    return StreetMap(road_map, tuple(lanes))


def _raised(lane: LaneSurface, along: Float, heights: Float) -> LaneSurface:
    lane = with_rows_at(lane, along)  # where its height bends
    height = np.interp(lane.s, along, heights)
    left, right = (np.column_stack([edge[:, :2], height]) for edge in (lane.left, lane.right))
    return replace(lane, left=left, right=right)
