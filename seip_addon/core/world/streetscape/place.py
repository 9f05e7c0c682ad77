"""The studied place of a map: its centre, its region of interest and its level, in map coordinates."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...base.errors import SeipError
from ...base.limits import SITE_RADIUS
from ...geometry.plan import closed, opened, united
from ...site.scene_geometry import DEFAULT_WEIGHT
from ..opendrive.junctions import find_junction, junction_area, nearest_junctions
from ..opendrive.lanes import LaneSurface
from ..opendrive.road_map import Junction, RoadMap
from . import road_surface
from .approaches import approach_lanes
from .description import DEFAULT_RADIUS, SiteDescription
from .intersections import JUNCTION_REACH, box_along, intersection, leads_between, ring_roads, with_other_carriageways
from .levels import Levels, split_levels
from .named_places import street_names
from .street_areas import GAP as JUNCTION_GAP
from .street_areas import MIN_ISLAND_AREA, SPIKE, TOLERANCE, tapers
from .street_map import JunctionArea

MIN_SHARE_OF_JUNCTION = 0.5  # share of a junction's area in a region from which on the region includes all of it
SCENE_MARGIN = 40.0  # metres that the scene extends beyond the region of interest, for occluders at its edge
MAX_ROAD_DISTANCE = 10.0  # metres from the centre of the place within which any road may be the requested one


@dataclass(frozen=True, eq=False)
class Place:
    """A place of a map, chosen by a site description.

    Parameters
    ----------
    road_map : RoadMap
        Map that the place is on.
    surfaces : sequence of LaneSurface
        Lanes of the map to consider, map coordinates.
    description : SiteDescription
        Choice of the place and its region.
    junctions : tuple of JunctionArea
        Areas of the junctions of a network, which was made from centre lines of streets: junctions within
        `JUNCTION_REACH` metres of each other are one place there. Empty for OpenDRIVE.
    """

    road_map: RoadMap
    surfaces: Sequence[LaneSurface]
    description: SiteDescription
    junctions: tuple[JunctionArea, ...] = ()

    @cached_property
    def centre(self) -> Float:
        """Centre of the place, (2,) metres."""
        description = self.description
        if description.near is not None:
            return np.array(description.near, dtype=np.float64)
        if description.junction is not None:
            middle = self._driving_area(self._junction).centroid
        elif description.region is not None:
            middle = description.region.centroid
        else:
            raise SeipError(
                "no place is named: give --near X Y or --junction ID, or near, junction or region in the site file"
            )
        return np.array([middle.x, middle.y])

    @cached_property
    def within(self) -> BaseGeometry:
        """Area that limits the region of interest."""
        if self.description.region is not None:
            return self.description.region
        if self.description.along is None:
            return shapely.Point(self.centre).buffer(self.description.radius or DEFAULT_RADIUS, quad_segs=32)
        lanes = self._approach_lanes()
        self._check_spread(lanes)
        if self.junctions:
            driving = road_surface.in_groups(self.surfaces, ["driving"])
            return with_other_carriageways(lanes, driving, self.road_map.names).convex_hull
        return shapely.union_all([shapely.make_valid(lane.polygon) for lane in lanes]).convex_hull

    def _check_spread(self, lanes: Sequence[LaneSurface]) -> None:
        """Check that the lanes of a junction and its approaches lie near each other.

        Raises
        ------
        SeipError
            A lane is farther from the first one than any site reaches.
        """
        for lane in lanes:
            away = float(np.hypot(*(lane.left[0, :2] - lanes[0].left[0, :2])))
            if away > 2 * SITE_RADIUS.most:
                raise SeipError(
                    f"road {lane.road_id} lies {away:,.0f} m from road {lanes[0].road_id} of the same junction: "
                    "correct its <planView> in the map"
                )

    def levels(self) -> Levels:
        """Return the lanes on the level of the place, and those on other levels."""
        around = self.within.convex_hull.buffer(SCENE_MARGIN, quad_segs=16)
        # The studied level is that of the junction, or of all roads about as near to the centre as the nearest one.
        if self.description.near is None and self.description.junction is not None:
            anchors = {lane.road_id for lane in self.surfaces if lane.junction_id in self._junctions}
        else:
            driving = road_surface.in_groups(self.surfaces, ["driving"])
            away = shapely.distance([lane.polygon for lane in driving], shapely.Point(self.centre))
            least = max(away.min(initial=np.inf), MAX_ROAD_DISTANCE)
            anchors = {lane.road_id for lane, distance in zip(driving, away, strict=True) if distance <= least}
        return split_levels(self.surfaces, around, anchors, self.description.level, street_names(self.road_map))

    def region(self) -> BaseGeometry:
        """Return the region of interest."""
        shift = np.array([*self.centre, 0.0])  # outlines need small coordinates for their grids
        within = shifted(self.within, -shift)
        lanes = self._lanes_of_region()
        driving = road_surface.in_groups(lanes, ["driving"])
        near = road_surface.local_strips(driving, shift, within) if driving else ()
        if near:
            outline = road_surface.without_holes(road_surface.lane_outline(near), least=road_surface.MAX_HOLE)
            if self.junctions:
                outline = self._whole_streets(near, shift)
            region = road_surface.without_crumbs(outline.intersection(within))
            if not region.is_empty:
                return shifted(region, shift)
        raise self._no_driving_lane()

    def _whole_streets(self, lanes: Sequence[LaneSurface], shift: Float) -> BaseGeometry:
        """Return the area of lanes (local axes) with the opposite carriageways of their streets and whole junctions.

        So are links that begin and end there, such as lanes for turning right, unless they have another name.
        """
        around = self.within.convex_hull.buffer(SCENE_MARGIN)
        driving = road_surface.in_groups(self.surfaces, ["driving"])
        nearby = road_surface.local_strips(driving, shift, shifted(around, -shift))
        area = with_other_carriageways(lanes, nearby, self.road_map.names)
        there = {lane.road_id for lane in nearby}
        joined = [one for one in self.junctions if there & one.roads]
        junctions = [shifted(one.carriageway, -shift) for one in joined]
        widened = [one.road for one in tapers(nearby, joined, self.road_map.roads)]
        inside = [one for one in junctions if one.intersection(area).area > MIN_SHARE_OF_JUNCTION * one.area]
        whole = closed(united([area, *inside]).simplify(TOLERANCE), JUNCTION_GAP)
        names = {"", *(self.road_map.names.get(lane.road_id, "") for lane in lanes)}
        roads = [
            own for road, own in road_surface.by_road(nearby).items() if self.road_map.names.get(road, "") in names
        ]
        links = [own for own in roads if all(leads_between(lane, whole) for lane in own)]
        whole = united([whole, *(lane.polygon for own in links for lane in own)])
        whole = united([whole, *(one for one in widened if one.intersection(whole.buffer(JUNCTION_GAP)).length > 0)])
        # Mitred corners of the closing that lie outside the road are no part of it.
        road = united([*(lane.polygon for lane in nearby), *junctions, *widened]).buffer(JUNCTION_GAP / 2)
        whole = closed(whole.simplify(TOLERANCE), JUNCTION_GAP).intersection(road)
        return road_surface.without_crumbs(opened(whole, SPIKE), least=MIN_ISLAND_AREA)

    def weighted_areas(self) -> list[tuple[str, BaseGeometry, float]]:
        """Return name, area and weight of the weighted regions.

        Without a description there is one: the box of the junction nearest to the centre.
        """
        described, (x, y) = self.description.weighted_regions, self.centre.tolist()
        if not described:
            nearest = nearest_junctions(self.road_map, self.surfaces, x, y, 1)
            return [(self._title(found), self._central_box(found), DEFAULT_WEIGHT) for found, _ in nearest]
        return [
            (one.name, one.polygon or self._central_box(self._found(one.junction or "")), one.weight)
            for one in described
        ]

    def _title(self, junction: Junction) -> str:
        """Return the title of a junction: its streets in a network, otherwise its id."""
        name = self.description.name if self.junctions else ""
        return name if name.startswith("Junction ") else f"Junction {name or junction.id}"

    def _lanes_of_region(self) -> Sequence[LaneSurface]:
        """Return the lanes that the region of interest may lie on.

        In a network, a circle around a junction excludes streets that only pass by.
        """
        description = self.description
        if description.along is not None:
            return self._approach_lanes()
        if self.junctions and description.near is not None:
            nearest = nearest_junctions(self.road_map, self.surfaces, float(self.centre[0]), float(self.centre[1]), 1)
            if nearest and nearest[0][1] <= JUNCTION_REACH:
                junctions = self._one_place(nearest[0][0])
                return approach_lanes(
                    self.surfaces, junctions, description.radius or DEFAULT_RADIUS, self.road_map.names
                )
        return self.surfaces

    @cached_property
    def _junction(self) -> Junction:
        return self._found(self.description.junction or "")

    @cached_property
    def _junctions(self) -> frozenset[str]:
        """Ids of the junctions at the centre of the place: one, or those of an intersection."""
        return self._one_place(self._junction)

    def _one_place(self, junction: Junction) -> frozenset[str]:
        if not self.junctions:
            return frozenset({junction.id})
        return intersection(self.surfaces, junction.id, self.description.roundabouts)

    def _found(self, id_or_name: str) -> Junction:
        return find_junction(self.road_map, self.surfaces, id_or_name)

    def _approach_lanes(self) -> tuple[LaneSurface, ...]:
        names = self.road_map.names if self.junctions else None
        return approach_lanes(self.surfaces, self._junctions, self.description.along or 0.0, names)

    def _driving_area(self, junction: Junction) -> BaseGeometry:
        driving = road_surface.in_groups(self.surfaces, ["driving"])
        areas = [junction_area(driving, number) for number in sorted(self._one_place(junction))]
        area = shapely.union_all(areas)
        return junction_area(self.surfaces, junction.id) if area.is_empty else area

    def _central_box(self, junction: Junction) -> BaseGeometry:
        """Return the smallest rectangle around a junction's driving lanes, aligned with its roads if possible."""
        if self.junctions:
            driving = road_surface.in_groups(self.surfaces, ["driving"])
            ring = ring_roads(self.road_map.roads, self.description.roundabouts, self._one_place(junction))
            around = [shapely.make_valid(lane.polygon) for lane in driving if lane.road_id in ring]
            return box_along(shapely.union_all([self._driving_area(junction), *around]), driving)
        return shapely.minimum_rotated_rectangle(self._driving_area(junction))

    def _no_driving_lane(self) -> SeipError:
        description, (x, y) = self.description, self.centre.tolist()
        where = f"within {description.radius or DEFAULT_RADIUS:g} m of ({x:g}, {y:g})"
        if description.along is not None:
            where = f"in junction {description.junction!r}"
        elif description.region is not None:
            where = "within the region"
        # Both numbers can be latitude and longitude, in either order.
        as_degrees = (
            max(abs(x), abs(y)) <= 180.0 and min(abs(x), abs(y)) <= 90.0 and not (x.is_integer() and y.is_integer())
        )
        hint = " (latitude and longitude are given by --near-latlon)" if description.near and as_degrees else ""
        return SeipError(f"there is no driving lane {where}{hint}{self._nearest()}")

    def _nearest(self) -> str:
        """Return the junctions nearest to the place, as the end of a sentence."""
        names, (x, y) = [], self.centre.tolist()
        for junction, _ in nearest_junctions(self.road_map, self.surfaces, x, y, 3):
            middle = junction_area(self.surfaces, junction.id).centroid
            names.append(f"{junction.id} at ({middle.x:.0f}, {middle.y:.0f})")
        if names:
            return f"; the nearest junctions are {', '.join(names)}"
        x_low, y_low, x_high, y_high = shapely.total_bounds([lane.polygon for lane in self.surfaces])
        return f"; the map's roads lie between ({x_low:.0f}, {y_low:.0f}) and ({x_high:.0f}, {y_high:.0f})"


def shifted(area: BaseGeometry, by: Float) -> BaseGeometry:
    """Return an area moved in plan by a vector (2,) or (3,), metres."""
    return shapely.transform(area, lambda xy: xy + by[:2])
