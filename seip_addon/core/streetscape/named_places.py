"""Streets and crossings of a map by their names, for results that say what is seen where."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import shapely
from shapely.geometry.base import BaseGeometry

from ..opendrive import LaneSurface, PlacedObject
from ..site.scene_geometry import NamedArea
from .map_furniture import footprint
from .road_surface import CARRIAGEWAY, in_groups, lane_outline

CROSSING = "crosswalk"
GRID = 1e-3  # metres to which outlines are rounded, so that no odd one fails
LEAST_AREA = 1.0
"""Square metres within the region of interest, below which a place is left out."""


def named_places(
    lanes: Sequence[LaneSurface], names: Mapping[str, str], objects: Iterable[PlacedObject], region: BaseGeometry
) -> tuple[NamedArea, ...]:
    """Return the streets outside junctions, then the painted crossings, each as far as it lies in a region.

    Parameters
    ----------
    lanes : sequence of LaneSurface
        In local axes.
    names : mapping of str to str
        Names of roads by their ids; a road without one is called after its id, a crossing after the nearest street.
    objects : iterable of PlacedObject
        In local axes.
    region : shapely geometry
        In plan, local.
    """
    streets: dict[str, list[LaneSurface]] = {}
    for lane in in_groups(lanes, CARRIAGEWAY):
        if lane.junction_id is None:
            streets.setdefault(names.get(lane.road_id) or f"Road {lane.road_id}", []).append(lane)
    street_areas = {name: lane_outline(own) for name, own in streets.items()}
    crossings: dict[str, list[BaseGeometry]] = {}
    for one in objects:
        if one.kind == CROSSING:
            area = _area(one)
            name = one.name or _crossed({name: street_areas[name] for name in names.values() if name in streets}, area)
            crossings.setdefault(name or f"Crossing {one.id}", []).append(area)
    areas = [
        *street_areas.items(),
        *((name, shapely.union_all(parts)) for name, parts in crossings.items()),
    ]
    within = ((name, shapely.intersection(area, region, grid_size=GRID)) for name, area in areas)
    return tuple(NamedArea(name, area) for name, area in within if area.area >= LEAST_AREA)


def _crossed(streets: Mapping[str, BaseGeometry], area: BaseGeometry) -> str:
    """Return what a crossing is called after the street of a name that is nearest to it; nothing where none has one."""
    nearest = min(streets, key=lambda name: streets[name].distance(area.centroid), default="")
    return f"Crossing of {nearest}" if nearest else ""


def _area(crossing: PlacedObject) -> BaseGeometry:
    rings = [outline.base for outline in crossing.outlines if len(outline.base) >= 3] or [
        footprint(crossing) + crossing.position
    ]
    return shapely.union_all([shapely.make_valid(shapely.Polygon(ring[:, :2])) for ring in rings])
