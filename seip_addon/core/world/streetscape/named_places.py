"""Named streets and crossings of a map, for results by place."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

import shapely
from shapely.geometry.base import BaseGeometry

from ...geometry.plan import without
from ...site.locations import direction
from ...site.scene_geometry import NamedArea
from ..opendrive.lanes import LaneSurface
from ..opendrive.objects import PlacedObject
from ..opendrive.road_map import RoadMap
from .map_furniture import footprint
from .road_surface import CARRIAGEWAY, in_groups, lane_outline, without_crumbs

CROSSING = "crosswalk"
ASSUMED_CROSSING = "Assumed crossing"
"""Name of a crossing in the map of an extract that the extract itself does not contain."""
MAX_MEDIAN = 6.0  # metres between the crossings of two carriageways that are one
ROUNDABOUT = "Roundabout"
TRACKS = {"tram": "Tram track", "rail": "Railway track"}
"""Name of the tracks beside streets, by lane type; tracks among the lanes of a street are part of it."""
_MIDDLE = shapely.Point(0.0, 0.0)  # of the place, local axes
GRID = 1e-3  # metres to which outlines are rounded, so that intersections do not fail
LEAST_AREA = 1.0
"""Least area of a place within the region of interest (square metres)."""


def named_places(
    lanes: Sequence[LaneSurface],
    names: Mapping[str, str],
    objects: Iterable[PlacedObject],
    region: BaseGeometry,
    *,
    unnamed: str = "",
    rings: Collection[str] = (),
) -> tuple[NamedArea, ...]:
    """Return the streets outside junctions, then tracks, then the painted crossings, each cut to a region.

    Parameters
    ----------
    lanes : sequence of LaneSurface
        Lanes in local axes.
    names : mapping of str to str
        Names of roads by their ids. A road without one is named by its id, a crossing after the nearest street; if a
        street has several crossings, their names include the direction from the origin.
    objects : iterable of PlacedObject
        Objects of the map in local axes.
    region : shapely geometry
        Region in plan, local axes.
    unnamed : str
        Name for streets without one, used with the direction of each arm if ids of roads mean nothing to a reader.
    rings : collection of str
        Ids of the roads of roundabouts.
    """
    paved = [lane for lane in in_groups(lanes, CARRIAGEWAY) if lane.junction_id is None]
    roads = {lane.road_id for lane in paved if lane.lane_type not in TRACKS}
    streets: dict[str, list[LaneSurface]] = {}
    tracks: dict[str, list[LaneSurface]] = {}
    for lane in paved:
        if lane.road_id in roads:
            other = (ROUNDABOUT if lane.road_id in rings else unnamed) or f"Road {lane.road_id}"
            streets.setdefault(names.get(lane.road_id) or other, []).append(lane)
        else:
            tracks.setdefault(TRACKS[lane.lane_type], []).append(lane)
    street_areas = {name: lane_outline(own) for name, own in streets.items()}
    crossed = {name: street_areas[name] for name in names.values() if name in streets}
    if unnamed in streets:
        crossed[f"an {unnamed[0].lower()}{unnamed[1:]}"] = street_areas[unnamed]
    areas: list[tuple[str, BaseGeometry]] = []
    for name, area in street_areas.items():
        areas += _by_arm(name, area, region) if name == unnamed else [(name, area)]
    areas += [(name, lane_outline(own)) for name, own in tracks.items()]
    within = ((name, shapely.intersection(area, region, grid_size=GRID)) for name, area in areas)
    found = [NamedArea(name, area, track=name in tracks) for name, area in within if area.area >= LEAST_AREA]
    return (*found, *_crossings(objects, crossed, region))


def _crossings(
    objects: Iterable[PlacedObject], streets: Mapping[str, BaseGeometry], region: BaseGeometry
) -> Iterator[NamedArea]:
    """Yield the crossings in a region, each once; several of one street are named with their direction."""
    crossings: dict[tuple[str, bool], list[tuple[BaseGeometry, str]]] = {}
    taken: BaseGeometry = shapely.Polygon()
    for one in objects:
        if one.kind == CROSSING:
            is_assumed = one.name == ASSUMED_CROSSING
            area = shapely.intersection(area_in_plan(one), region, grid_size=GRID)
            name = one.name if one.name and not is_assumed else _crossed(streets, area_in_plan(one))
            area = without_crumbs(without(area, taken))  # streets that meet at an acute angle are crossed together
            if area.area >= LEAST_AREA:
                taken = taken.union(area)
                crossings.setdefault((name or f"Crossing {one.id}", is_assumed), []).append((area, one.name))
    numbers = Counter(name for name, _ in crossings)
    for (name, is_assumed), own_areas in crossings.items():
        called = Counter[str]()
        found = _whole(own_areas)
        # Mapped and assumed crossings of one street are counted together, so that their names stay different.
        several = len(found) > 1 or numbers[name] > 1
        for area, own in sorted(found, key=lambda one: float(one[0].distance(_MIDDLE))):
            arm = f"{name}, {_direction(area)} arm" if several and own != name else name
            called[arm] += 1
            label = arm + (f" ({called[arm]})" if called[arm] > 1 else "") + (" (assumed)" if is_assumed else "")
            yield NamedArea(label, area, crossing=True)


def _whole(crossings: Sequence[tuple[BaseGeometry, str]]) -> list[tuple[BaseGeometry, str]]:
    """Return crossings, with those of the two carriageways at a median merged into one."""
    found: list[tuple[BaseGeometry, str]] = []
    for area, own in crossings:
        near = [one for one in found if one[0].distance(area) < MAX_MEDIAN]
        found = [*(one for one in found if one not in near), (shapely.union_all([area, *(a for a, _ in near)]), own)]
    return found


def _by_arm(name: str, area: BaseGeometry, region: BaseGeometry) -> Iterator[tuple[str, BaseGeometry]]:
    """Yield the parts of an area by direction from the centre of the place, with the direction in the name."""
    arms: dict[str, list[BaseGeometry]] = {}
    for part in shapely.get_parts(shapely.intersection(area, region, grid_size=GRID)):
        if part.area >= LEAST_AREA:
            arms.setdefault(_direction(part), []).append(part)
    for towards, parts in arms.items():
        yield (f"{name}, {towards} arm" if len(arms) > 1 else name), shapely.union_all(parts)


def _direction(area: BaseGeometry) -> str:
    """Return the compass direction from the centre of the place to an area."""
    middle = area.centroid
    return direction((middle.x, middle.y))


def street_names(road_map: RoadMap) -> dict[str, str]:
    """Return the street name of each road by its id; roads without one are left out.

    A road in a junction without a name has the name of the road before it, or of the road after it.
    """
    names = {road.id: road.name for road in road_map.roads if road.name}
    joints = {}
    for road in road_map.roads:
        if road.id not in names and road.junction_id is not None:
            links = (link for link in (road.predecessor, road.successor) if link is not None and link.kind == "road")
            joints[road.id] = next((names[link.id] for link in links if link.id in names), "")
    return names | {number: name for number, name in joints.items() if name}


def _crossed(streets: Mapping[str, BaseGeometry], area: BaseGeometry) -> str:
    """Return the name of a crossing from the nearest named street, "" if there is none."""
    nearest = min(streets, key=lambda name: streets[name].distance(area.centroid), default="")
    return f"Crossing of {nearest}" if nearest else ""


def area_in_plan(placed: PlacedObject) -> BaseGeometry:
    """Return the area in plan of an object: of its outlines, or of its box or cylinder."""
    rings = [outline.base for outline in placed.outlines if len(outline.base) >= 3]
    rings = rings or [footprint(placed) + placed.position]
    return shapely.union_all([shapely.make_valid(shapely.Polygon(ring[:, :2])) for ring in rings])
