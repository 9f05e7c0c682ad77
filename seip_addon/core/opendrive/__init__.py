"""OpenDRIVE maps: roads, lane surfaces, objects and signals in map coordinates."""

from .junctions import find_junction, junction_area, nearest_junctions
from .lanes import LaneSurface, lane_surfaces
from .objects import Outline, PlacedObject, placed_objects
from .read import read_map
from .road_map import Junction, Road, RoadMap
from .signals import PlacedSignal, placed_signals

__all__ = [
    "Junction", "LaneSurface", "Outline", "PlacedObject", "PlacedSignal", "Road", "RoadMap",
    "find_junction", "junction_area", "lane_surfaces", "nearest_junctions",
    "placed_objects", "placed_signals", "read_map",
]  # fmt: skip
