"""Streets and crossings of a map by their names, for results that say what is seen where."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

import shapely
from shapely.geometry.base import BaseGeometry

from ...geometry.plan import without
from ...site.scene_geometry import NamedArea
from ..opendrive.lanes import LaneSurface
from ..opendrive.objects import PlacedObject
from ..opendrive.road_map import RoadMap
from .map_furniture import footprint
from .road_surface import CARRIAGEWAY, in_groups, lane_outline, without_crumbs

CROSSING = "crosswalk"
ASSUMED_CROSSING = "Assumed crossing"
"""Name of a crossing that the map of an extract has though the extract does not."""
MAX_MEDIAN = 6.0  # metres between the crossings of two carriageways that are one
ROUNDABOUT = "Roundabout"
DIRECTIONS = ("east", "north-east", "north", "north-west", "west", "south-west", "south", "south-east")
_MIDDLE = shapely.Point(0.0, 0.0)  # of the place, local axes
GRID = 1e-3  # metres to which outlines are rounded, so that no odd one fails
LEAST_AREA = 1.0
"""Square metres within the region of interest, below which a place is left out."""


def named_places(
    lanes: Sequence[LaneSurface],
    names: Mapping[str, str],
    objects: Iterable[PlacedObject],
    region: BaseGeometry,
    *,
    unnamed: str = "",
    rings: Collection[str] = (),
) -> tuple[NamedArea, ...]:
    """Return the streets outside junctions, then the painted crossings, each as far as it lies in a region.

    Parameters
    ----------
    lanes : sequence of LaneSurface
        In local axes.
    names : mapping of str to str
        Names of roads by their ids; a road without one is called after its id, a crossing after the nearest street:
        of several crossings of one street each has the direction in which it lies from the origin.
    objects : iterable of PlacedObject
        In local axes.
    region : shapely geometry
        In plan, local.
    unnamed : str
        What streets without a name are called, with the direction of each arm, where ids say nothing to anybody.
    rings : collection of str
        Ids of the roads of roundabouts.
    """
    streets: dict[str, list[LaneSurface]] = {}
    for lane in in_groups(lanes, CARRIAGEWAY):
        if lane.junction_id is None:
            other = (ROUNDABOUT if lane.road_id in rings else unnamed) or f"Road {lane.road_id}"
            streets.setdefault(names.get(lane.road_id) or other, []).append(lane)
    street_areas = {name: lane_outline(own) for name, own in streets.items()}
    crossed = {name: street_areas[name] for name in names.values() if name in streets}
    if unnamed in streets:
        crossed[f"an {unnamed[0].lower()}{unnamed[1:]}"] = street_areas[unnamed]
    areas: list[tuple[str, BaseGeometry]] = []
    for name, area in street_areas.items():
        areas += _by_arm(name, area, region) if name == unnamed else [(name, area)]
    within = ((name, shapely.intersection(area, region, grid_size=GRID)) for name, area in areas)
    found = [NamedArea(name, area) for name, area in within if area.area >= LEAST_AREA]
    return (*found, *_crossings(objects, crossed, region))


def _crossings(
    objects: Iterable[PlacedObject], streets: Mapping[str, BaseGeometry], region: BaseGeometry
) -> Iterator[NamedArea]:
    """Yield the crossings in a region, each once: of several of one street each has the direction that it lies in."""
    crossings: dict[tuple[str, bool], list[tuple[BaseGeometry, str]]] = {}
    taken: BaseGeometry = shapely.Polygon()
    for one in objects:
        if one.kind == CROSSING:
            is_assumed = one.name == ASSUMED_CROSSING
            area = shapely.intersection(_area(one), region, grid_size=GRID)
            name = one.name if one.name and not is_assumed else _crossed(streets, _area(one))
            area = without_crumbs(without(area, taken))  # streets that meet at an acute angle are crossed together
            if area.area >= LEAST_AREA:
                taken = taken.union(area)
                crossings.setdefault((name or f"Crossing {one.id}", is_assumed), []).append((area, one.name))
    numbers = Counter(name for name, _ in crossings)
    for (name, is_assumed), own_areas in crossings.items():
        called = Counter[str]()
        found = _whole(own_areas)
        several = len(found) > 1 or numbers[name] > 1
        for area, own in sorted(found, key=lambda one: float(one[0].distance(_MIDDLE))):
            arm = f"{name}, {_direction(area)} arm" if several and own != name else name
            called[arm] += 1
            label = arm + (f" ({called[arm]})" if called[arm] > 1 else "") + (" (assumed)" if is_assumed else "")
            yield NamedArea(label, area, crossing=True)


def _whole(crossings: Sequence[tuple[BaseGeometry, str]]) -> list[tuple[BaseGeometry, str]]:
    """Return crossings, those of the carriageways on both sides of a median as one."""
    found: list[tuple[BaseGeometry, str]] = []
    for area, own in crossings:
        near = [one for one in found if one[0].distance(area) < MAX_MEDIAN]
        found = [*(one for one in found if one not in near), (shapely.union_all([area, *(a for a, _ in near)]), own)]
    return found


def _by_arm(name: str, area: BaseGeometry, region: BaseGeometry) -> Iterator[tuple[str, BaseGeometry]]:
    """Yield the parts of an area that lie in different directions from the middle of the place, each with its own."""
    arms: dict[str, list[BaseGeometry]] = {}
    for part in shapely.get_parts(shapely.intersection(area, region, grid_size=GRID)):
        if part.area >= LEAST_AREA:
            arms.setdefault(_direction(part), []).append(part)
    for direction, parts in arms.items():
        yield (f"{name}, {direction} arm" if len(arms) > 1 else name), shapely.union_all(parts)


def _direction(area: BaseGeometry) -> str:
    """Return the compass direction from the middle of the place to an area."""
    middle = area.centroid
    return DIRECTIONS[round(math.atan2(middle.y, middle.x) / (math.tau / len(DIRECTIONS))) % len(DIRECTIONS)]


def street_names(road_map: RoadMap) -> dict[str, str]:
    """Return the name of the street that each road is part of, by its id, as far as it has one.

    A road in a junction that has none is part of the street that it leads on.
    """
    names = {road.id: road.name for road in road_map.roads if road.name}
    joints = {}
    for road in road_map.roads:
        if road.id not in names and road.junction_id is not None:
            links = (link for link in (road.predecessor, road.successor) if link is not None and link.kind == "road")
            joints[road.id] = next((names[link.id] for link in links if link.id in names), "")
    return names | {number: name for number, name in joints.items() if name}


def _crossed(streets: Mapping[str, BaseGeometry], area: BaseGeometry) -> str:
    """Return what a crossing is called after the street of a name that is nearest to it; nothing where none has one."""
    nearest = min(streets, key=lambda name: streets[name].distance(area.centroid), default="")
    return f"Crossing of {nearest}" if nearest else ""


def _area(crossing: PlacedObject) -> BaseGeometry:
    rings = [outline.base for outline in crossing.outlines if len(outline.base) >= 3] or [
        footprint(crossing) + crossing.position
    ]
    return shapely.union_all([shapely.make_valid(shapely.Polygon(ring[:, :2])) for ring in rings])
