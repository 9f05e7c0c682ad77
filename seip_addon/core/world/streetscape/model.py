"""Model of a site: the parts of a scene from a map and a site description, in local axes."""

from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...base.counts import counted
from ...base.errors import SeipError
from ...base.progress import Progress
from ...geometry.plan import united, without
from ...site.post_rules import RULES
from ...site.roles import AREA_OVERLAYS, Role
from ...site.scene_geometry import ASSUMED, NamedArea
from ...site.sources import SourceCount, count_sources
from ..opendrive.objects import TUNNEL, PlacedObject, PlacedSignal, extent_in_plan
from .clearing import clear
from .described_parts import described_parts
from .description import PLACED_FIELDS, SiteDescription
from .intersections import ring_roads
from .levels import MIN_LEVEL_HEIGHT, UNNAMED_ROAD, Levels
from .map_furniture import CROWN_SHARE, is_trunk, landings, object_parts
from .named_places import named_places, street_names
from .parts import Part
from .place import Place, shifted
from .road_checks import road_warnings
from .road_surface import without_crumbs
from .signal_posts import signal_parts, split_posts
from .site_ground import SiteGround, on_relief, site_ground
from .site_surfaces import (
    CANDIDATE_MARGIN,
    PART_NAMES,
    area_part,
    marking_part,
    other_level_parts,
    side_way_parts,
    street_surface,
    verge_part,
)
from .street_areas import medians
from .street_map import StreetMap
from .terrain import Relief

STEPS = ("place", "ground", "objects", "carriageway", "pavements", "verge", "checks")
"""Steps of `street_model` in their order."""
UNNAMED_STREET = "Unnamed street"


@dataclass(frozen=True, eq=False)
class SiteModel:
    """A site as the parts of a scene.

    Parameters
    ----------
    origin : (3,) float64, metres
        Map coordinates of the local origin, whole metres.
    geo_reference : str or None
        Projection of the map, as the map gives it.
    header_offset : (4,) float64
        Header offset of the map: x, y, z in metres and heading in radians.
    parts : tuple of Part
        Objects of the scene.
    region : shapely geometry
        Region of interest in plan, local axes.
    notes : tuple of str
        Assumptions made where the map lacks data, one sentence each.
    warnings : tuple of str
        Reasons to distrust results of the scene, one sentence each.
    places : tuple of NamedArea
        Streets and crossings of the map in the region, local axes.
    attribution : tuple of str
        Credits required by the sources of the site.
    """

    name: str
    origin: Float
    geo_reference: str | None
    header_offset: Float
    parts: tuple[Part, ...]
    region: BaseGeometry
    notes: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    places: tuple[NamedArea, ...] = ()
    attribution: tuple[str, ...] = ()

    def sources(self) -> tuple[SourceCount, ...]:
        """Count the parts by kind and source, except those that are only seen."""
        return count_sources(
            (part.name, part.source, part.height_assumed or part.width_assumed or part.source == ASSUMED)
            for part in self.parts
            if part.source and set(part.roles) != {Role.DRESSING}
        )


def street_model(streets: StreetMap, description: SiteDescription) -> Generator[Progress, None, SiteModel]:
    """Model a place of a map.

    Parameters
    ----------
    streets : StreetMap
        Streets of the map.
    description : SiteDescription
        Choice of the place, and objects there that the map lacks.

    Yields
    ------
    Progress
        Number of completed steps.

    Raises
    ------
    SeipError
        The junction does not exist, or there is no road at the place or in the region of interest.
    """
    road_map, surfaces = streets.road_map, streets.lanes
    if not surfaces:
        raise SeipError(f"map {road_map.name!r} has no lane with an area: give its lanes widths, or use another map")
    yield _step("place")
    # In map coordinates: the place, its level, and its region.
    place = Place(road_map, surfaces, description, streets.junctions)
    levels = place.levels()
    place = replace(place, surfaces=levels.studied)
    region = place.region()
    origin = _origin(place, description.relief)
    yield _step("ground")
    # From here on in local axes: objects of the description and of the map.
    described = _local_description(description, origin)
    street = site_ground(streets, levels, origin, shifted(region, -origin), described)
    yield _step("objects")
    described, clear_notes = clear(described, street.roadside.carriageway, street.roadside.mouths)
    objects = _map_objects(streets, street)
    furniture = _furniture(objects, _map_signals(streets, street, levels), described, street)
    yield _step("carriageway")
    surface = street_surface(street)
    yield _step("pavements")
    ways = side_way_parts(described, street, surface.area)
    yield _step("verge")
    laid = [*surface.parts, *ways]
    parts = [
        *laid,
        verge_part(street, furniture.parts, laid),
        *other_level_parts(street),
        marking_part(street, has_signals=bool(furniture.signals or described.signal_poles)),
        *furniture.parts,
        *_overlay_parts(place, described, objects, street),
    ]
    yield _step("checks")
    in_junction = description.junction and f"junction {description.junction}"
    names = street_names(road_map)
    unnamed = UNNAMED_ROAD if streets.junctions else ""
    warnings = road_warnings(road_map, (*street.lanes, *street.crossing.lanes), names, origin, unnamed)
    return SiteModel(
        name=description.name or ", ".join(filter(None, (road_map.name, in_junction))),
        origin=origin,
        geo_reference=road_map.geo_reference,
        header_offset=road_map.header_offset,
        parts=tuple(_with_source(part, description) for part in parts if part.solid.faces),
        region=street.region,
        notes=(
            *_level_notes(levels),
            *clear_notes,
            *surface.notes,
            *_furniture_notes(objects, furniture.signals),
            *_tunnel_notes(objects, names),
        ),
        warnings=warnings,
        places=named_places(
            street.lanes,
            names,
            objects,
            street.region,
            unnamed=UNNAMED_STREET if streets.junctions else "",
            rings=ring_roads(road_map.roads, description.roundabouts),
        ),
        attribution=tuple(dict.fromkeys((*road_map.attribution, *description.attribution))),
    )


def _step(name: str) -> Progress:
    return Progress(STEPS.index(name), len(STEPS), "streets", counted=False)


def _local_description(description: SiteDescription, origin: Float) -> SiteDescription:
    """Return a description with objects and areas in local axes; the place and the ground stay as they are."""
    local: dict[str, Any] = {
        name: tuple(_local(one, origin) for one in getattr(description, name)) for name in PLACED_FIELDS
    }
    return replace(description, **local)


def _local(item: Any, origin: Float) -> Any:  # noqa: ANN401  # of any dataclass in a description
    """Return an object or area of a description in local axes: all that is a shape or an array of places in it."""
    moved: dict[str, Any] = {}
    for name, value in vars(item).items():
        if isinstance(value, BaseGeometry):
            moved[name] = shifted(value, -origin)
        elif isinstance(value, np.ndarray):
            moved[name] = value - origin[: value.shape[1]]
    return replace(item, **moved)


def _map_objects(streets: StreetMap, street: SiteGround) -> tuple[PlacedObject, ...]:
    """Return the objects of the map within the extent, on the ground, in local axes."""
    area = shifted(street.extent, street.origin)
    near = (one for one in streets.road_map.objects if extent_in_plan(one).intersects(area))
    # An object is raised as a whole by the ground under its position.
    return tuple(one.moved(on_relief(one.position, street.relief) - one.position - street.origin) for one in near)


def _map_signals(streets: StreetMap, street: SiteGround, levels: Levels) -> list[PlacedSignal]:
    """Return the signals of the map within the extent and on the studied level, on the ground, in local axes."""
    away, area = levels.other_roads(), shifted(street.extent, street.origin)
    return [
        replace(one, position=on_relief(one.position, street.relief) - street.origin)
        for one in streets.road_map.signals
        if one.road_id not in away and area.intersects(shapely.Point(one.position[:2]))
    ]


@dataclass(frozen=True, eq=False)
class _Furniture:
    """Parts that stand on the ground; those of traffic lights of the map, which are among them, also separately."""

    parts: tuple[Part, ...]
    signals: tuple[Part, ...]


def _furniture(
    objects: Sequence[PlacedObject],
    map_signals: Sequence[PlacedSignal],
    described: SiteDescription,
    street: SiteGround,
) -> _Furniture:
    """Return the parts of the map's objects and signals, and of the description, all in local axes."""
    others, lights = split_posts(objects, map_signals, street.roadside)
    signals = tuple(_checked_pole(part, street) for part in signal_parts(lights, street.roadside, street.terrain))
    own = (_checked_pole(part, street) for part in object_parts(others, street.roadside.carriageway))
    return _Furniture((*own, *signals, *described_parts(described, street)), signals)


def _overlay_parts(
    place: Place, described: SiteDescription, objects: Sequence[PlacedObject], street: SiteGround
) -> list[Part]:
    """Return the overlays on the ground: region of interest, weighted regions, and areas for sensors."""
    weighted = [(name, shifted(area, -street.origin), weight) for name, area, weight in place.weighted_areas()]
    return [
        area_part("Region of interest", street.region, Role.REGION, street),
        *_weighted_parts(weighted, street, described=bool(described.weighted_regions)),
        *_area_parts(described, street),
        *_keep_off_parts(described, objects, street),
    ]


def _with_source(part: Part, description: SiteDescription) -> Part:
    """Return a part with the source of the map if it has none; overlays that only mark areas need none."""
    if part.source or AREA_OVERLAYS.keys() >= set(part.roles):
        return part
    assumed = any(part.name in PART_NAMES.get(group, ()) for group in description.widths_assumed)
    return replace(part, source=description.map_source, width_assumed=assumed)


def _furniture_notes(placed: Sequence[PlacedObject], signals: Sequence[Part]) -> Iterator[str]:
    """Yield notes on assumed posts of traffic lights and assumed crowns of trees."""
    assumed = sum(part.source == ASSUMED for part in signals)
    if assumed:
        posts = counted(assumed, "post of traffic lights is", "posts of traffic lights are")
        yield f"{posts} assumed, because the map has none there: they carry sensors only with assumed poles allowed"
    trunks = sum(map(is_trunk, placed))
    if trunks:
        trees = counted(trunks, "tree")
        yield f"the map gives {trees} the width of a trunk: the crowns are taken as {CROWN_SHARE:g} times the height"


def _tunnel_notes(placed: Sequence[PlacedObject], names: Mapping[str, str]) -> Iterator[str]:
    for one in placed:
        if one.kind == TUNNEL:
            street = names.get(one.road_id) or f"road {one.road_id}"
            yield f"tunnel {one.name or one.id} of {street} is built as an open road, without its walls and its roof"


def _level_notes(levels: Levels) -> Iterator[str]:
    roads = levels.other_roads()
    noted = set()  # each carriageway of a street crosses the other street, which is one crossing for the user
    for crossing in levels.crossings:
        streets = (crossing.called(crossing.above), crossing.called(crossing.below), crossing.above in roads)
        if streets not in noted:
            noted.add(streets)
            away = "upper" if crossing.above in roads else "lower"
            yield f"{crossing}: the {away} one is on another level; it is modelled but not studied"


def _checked_pole(part: Part, street: SiteGround) -> Part:
    """Return a part of the map, as an occluder only if it is a pole on a different level or in a lane."""
    if Role.POLES not in part.roles:
        return part
    x, y, z = part.foot
    away = abs(z - float(street.terrain.height(np.array([[x, y]]))[0])) > MIN_LEVEL_HEIGHT
    in_lane = shapely.intersects_xy(street.lane_interiors, x, y)
    return replace(part, roles=(Role.OCCLUDERS,), source="") if away or in_lane else part


def _origin(place: Place, relief: Relief | None) -> Float:
    """Return the local origin (3,), whole metres: the centre, at the height of the nearest point of a road."""
    points = np.concatenate([np.concatenate([lane.left, lane.right]) for lane in place.surfaces])
    nearest = points[np.argmin(np.hypot(*(points[:, :2] - place.centre).T))]
    return np.round([*place.centre, on_relief(nearest, relief)[2]])


def _weighted_parts(
    areas: Sequence[tuple[str, BaseGeometry, float]], street: SiteGround, *, described: bool
) -> Iterator[Part]:
    for name, area, weight in areas:
        if area.intersects(street.region):
            yield area_part(name, area, Role.WEIGHTED_REGIONS, street, weight=weight)
        elif described:
            raise SeipError(
                f"the weighted region {name!r} lies outside the region of interest; move it or widen the region"
            )


def _area_parts(description: SiteDescription, street: SiteGround) -> list[Part]:
    kinds = ((description.forbidden_areas, Role.FORBIDDEN_AREAS), (description.mandatory_areas, Role.MANDATORY_AREAS))
    return [area_part(area.name, area.polygon, role, street) for areas, role in kinds for area in areas]


def _keep_off_parts(description: SiteDescription, placed: Sequence[PlacedObject], street: SiteGround) -> Iterator[Part]:
    """Yield the areas from which rules exclude new posts, cut to the surroundings of the region.

    Landings at the crossings of the map are added unless it is a network: netconvert guesses crossings.
    """
    areas = [(one.rule, one.polygon) for one in description.keep_off_areas]
    if street.areas is not None:
        areas.append(("islands", medians(street.roadside)))
    else:
        areas += [("landings", landing) for landing in landings(placed)]
    near = without(street.region.buffer(CANDIDATE_MARGIN), street.roadside.carriageway)
    for number, (rule, about) in enumerate(RULES.items()):
        area = without_crumbs(united(area for name, area in areas if name == rule).intersection(near))
        part = area_part(f"No new posts: {about.title.lower()}", area, Role.FORBIDDEN_AREAS, street, step=number)
        yield replace(part, keep_off=rule)
