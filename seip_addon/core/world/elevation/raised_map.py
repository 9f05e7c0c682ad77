"""Maps of the streets of an extract with heights: on the ground, on bridges, and in underpasses."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from ...arrays import Float
from ..opendrive.profile import profile
from ..opendrive.road_map import RoadMap

Profiles = Mapping[str, tuple[Float, Float]]
"""Stations (n,) along each road and heights (n,) there, metres, by road id."""
_PROFILE = re.compile(r"<elevationProfile\s*/>|<elevationProfile>.*?</elevationProfile>", re.DOTALL)


def raised_map(road_map: RoadMap, profiles: Profiles) -> RoadMap:
    """Return a map with new heights of roads, linear between the given stations."""
    records = {
        number: [(s, (height, slope, 0.0, 0.0)) for s, height, slope in _records(*own)]
        for number, own in profiles.items()
    }
    roads = (replace(road, elevation=profile(records[road.id])) for road in road_map.roads)
    return replace(road_map, roads=tuple(roads))


def raised_text(text: str, road_map: RoadMap, profiles: Profiles) -> str:
    """Return the text of a map with new heights of roads.

    Parameters
    ----------
    text : str
        Map as written by netconvert, with one elevation profile for each road.
    road_map : RoadMap
        The same map.
    profiles : Profiles
        Heights of all its roads.
    """
    elements = (
        "".join(
            f'<elevation s="{s:.8f}" a="{height:.4f}" b="{slope:.8f}" c="0" d="0"/>'
            for s, height, slope in _records(*profiles[road.id])
        )
        for road in road_map.roads
    )
    return _PROFILE.sub(lambda _: f"<elevationProfile>{next(elements)}</elevationProfile>", text)


def _records(along: Float, heights: Float) -> Iterator[tuple[float, float, float]]:
    """Yield station, height and slope of each linear piece."""
    lengths = np.diff(along)
    slopes = np.divide(np.diff(heights), lengths, out=np.zeros(len(lengths)), where=lengths > 0)
    yield from zip(along[:-1].tolist(), heights[:-1].tolist(), slopes.tolist(), strict=True)
