"""The map of an extract's streets with heights of its own: on the ground, on bridges, and in underpasses."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from ...arrays import Float
from ..opendrive.profile import profile
from ..opendrive.road_map import RoadMap

Profiles = Mapping[str, tuple[Float, Float]]
"""For each road, by its id, places (n,) along it, and the heights (n,) there, metres."""
_PROFILE = re.compile(r"<elevationProfile\s*/>|<elevationProfile>.*?</elevationProfile>", re.DOTALL)


def raised_map(road_map: RoadMap, profiles: Profiles) -> RoadMap:
    """Return a map whose roads have other heights, straight between the places that are given."""
    records = {
        number: [(s, (height, slope, 0.0, 0.0)) for s, height, slope in _records(*own)]
        for number, own in profiles.items()
    }
    roads = (replace(road, elevation=profile(records[road.id])) for road in road_map.roads)
    return replace(road_map, roads=tuple(roads))


def raised_text(text: str, road_map: RoadMap, profiles: Profiles) -> str:
    """Return the text of a map whose roads have other heights.

    Parameters
    ----------
    text : str
        As netconvert writes it: each road with one profile of heights.
    road_map : RoadMap
        The same map as it is read.
    profiles : Profiles
        Of all its roads.
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
    """Yield place, height and slope of each straight piece."""
    lengths = np.diff(along)
    slopes = np.divide(np.diff(heights), lengths, out=np.zeros(len(lengths)), where=lengths > 0)
    yield from zip(along[:-1].tolist(), heights[:-1].tolist(), slopes.tolist(), strict=True)
