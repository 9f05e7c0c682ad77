"""The map of an extract's streets with the heights of the ground that its scene is laid on."""

import re
from collections.abc import Iterator

import numpy as np

from ..opendrive import RoadMap
from ..opendrive.road_map import Road
from ..streetscape.terrain import Relief

STEP = 10.0  # metres along a road between two heights, as between the rows of its lanes
_PROFILE = re.compile(r"<elevationProfile\s*/>|<elevationProfile>.*?</elevationProfile>", re.DOTALL)


def raised_map(text: str, road_map: RoadMap, relief: Relief) -> str:
    """Return a map whose roads climb with the ground, by straight pieces of `STEP` metres at most.

    Parameters
    ----------
    text : str
        As netconvert writes it: each road with one profile of heights.
    road_map : RoadMap
        The same map as it is read.
    """
    profiles = (_profile(road, relief) for road in road_map.roads)
    return _PROFILE.sub(lambda _: next(profiles), text)


def _profile(road: Road, relief: Relief) -> str:
    along = np.linspace(0.0, road.length, max(int(np.ceil(road.length / STEP)), 1) + 1)
    x, y, _ = road.reference_line(along)
    heights = road.elevation(along) + relief.rise(np.column_stack([x, y]))
    return f"<elevationProfile>{''.join(_records(along.tolist(), heights.tolist()))}</elevationProfile>"


def _records(along: list[float], heights: list[float]) -> Iterator[str]:
    for place, following, height, end in zip(along[:-1], along[1:], heights[:-1], heights[1:], strict=True):
        slope = (end - height) / (following - place) if following > place else 0.0
        yield f'<elevation s="{place:.8f}" a="{height:.4f}" b="{slope:.8f}" c="0" d="0"/>'
