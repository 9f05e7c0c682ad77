"""Site descriptions: data about a place that its map lacks, in map coordinates (metres) and radians.

Its use is shown in `tests/core/world/streetscape/test_site_model.py`.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...site.post_rules import KeepOffArea, RuleName
from ...site.scene_geometry import DESCRIBED, FROM_MAP
from .terrain import Relief

DEFAULT_RADIUS = 80.0

OBJECT_FIELDS = ("buildings", "trees", "walls", "street_lights", "signal_poles", "slabs", "posts")
"""Fields of a description with objects that stand at the place."""
PLACED_FIELDS = (*OBJECT_FIELDS, "ways", "forbidden_areas", "mandatory_areas", "keep_off_areas")
"""Fields of a description with objects and areas in map coordinates."""


@dataclass(frozen=True, eq=False)
class Area:
    """A named area in plan, map coordinates."""

    name: str
    polygon: Polygon


@dataclass(frozen=True, eq=False)
class WeightedRegion:
    """A region whose targets have a weight: a polygon, or the central box of a junction."""

    name: str
    weight: float
    polygon: Polygon | None = None
    junction: str | None = None


@dataclass(frozen=True, eq=False)
class Building:
    """A building with a flat roof.

    Parameters
    ----------
    outline : Polygon
        Outline in plan; courtyards are its holes.
    height, base : float, metres
        Height of its top above its base, and of the base above the ground.
    source : str
        Source of the building, as in `scene_geometry.Pole`.
    height_assumed : bool
        Whether the source lacks its height.
    """

    outline: Polygon
    height: float
    base: float = 0.0
    source: str = DESCRIBED
    height_assumed: bool = False


@dataclass(frozen=True, eq=False)
class Trees:
    """Trees of one size at ``positions`` (n, 2); for ``source`` and ``height_assumed`` see `Building`."""

    positions: Float
    height: float
    crown_diameter: float
    source: str = DESCRIBED
    height_assumed: bool = False


@dataclass(frozen=True, eq=False)
class Wall:
    """A wall along ``line`` (n, 2), with a material and a name; for the rest see `Building`."""

    line: Float
    height: float
    thickness: float
    base: float = 0.0
    name: str = "Wall"
    material: str = "wall"
    source: str = DESCRIBED
    height_assumed: bool = False


@dataclass(frozen=True, eq=False)
class Poles:
    """Posts of one kind at ``positions`` (n, 2).

    Parameters
    ----------
    positions : (n, 2) float64, metres
        Feet of the posts, map coordinates.
    height, arm : float, metres
        Height of the post, and length of its arm.
    heading : float or None, radians
        Direction of the arm, counter-clockwise from map x (east); None points it to the nearest carriageway.
    source, height_assumed
        See `Building`.
    name : str
        Kind of the posts, if these are neither street lights nor signals.
    keep_off : str or None
        Rule that excludes sensors from the posts, unless it is allowed.
    carries : bool
        Whether the posts may carry sensors at all.
    """

    positions: Float
    height: float
    arm: float
    heading: float | None
    source: str = DESCRIBED
    height_assumed: bool = False
    name: str = "Post"
    keep_off: RuleName | None = None
    carries: bool = True


@dataclass(frozen=True, eq=False)
class Slab:
    """A plate over ``outline`` from ``base`` to ``top`` metres above the ground, such as a canopy, shelter or hedge."""

    outline: Polygon
    base: float
    top: float
    name: str
    material: str = "roof"
    source: str = DESCRIBED
    height_assumed: bool = False


@dataclass(frozen=True, eq=False)
class SideWay:
    """A footway, cycle track or driveway that is not part of the road.

    Parameters
    ----------
    area : shapely geometry
        Area in plan, map coordinates.
    material, name : str
        Material and name of its surface.
    keep_off : str or None
        Rule that excludes new posts from it.
    line : (n, 2) float64, metres, or None
        Centre line of a sidewalk, which is the pavement of the street along it; None for other ways.
    width : float, metres
        Width of the sidewalk along that line.
    """

    area: BaseGeometry
    material: str
    name: str
    keep_off: RuleName | None = None
    line: Float | None = None
    width: float = 0.0


@dataclass(frozen=True, eq=False)
class SiteDescription:
    """A place to study and the objects there.

    Parameters
    ----------
    name : str
        Title of the place; the map's name if empty.
    map : Path or None
        File of the map.
    near : (x, y) or None
        Centre of the place, map coordinates.
    junction : str or None
        Id or name of the junction at the centre of the place.
    radius : float or None, metres
        Radius of the region of interest, which is the driving surface within it.
    approaches : float or None, metres
        Length of the approaches, instead of the radius: the region is the driving surface of the junction and of its
        approaches this far along the roads. Without either, a junction has approaches of `DEFAULT_RADIUS`, and any
        other place that radius.
    region : shapely geometry or None
        Area of the region, instead of both: the driving surface within it.
    level : tuple of str
        Names of streets, or ids of roads, on the level to study, where roads lie above each other.
    weighted_regions, buildings, trees, walls, street_lights, signal_poles, forbidden_areas, mandatory_areas : tuple
        Objects and areas listed in the file.
    slabs, posts, ways : tuple
        Plates, plain posts, and ways next to the road, from an extract.
    keep_off_areas : tuple of KeepOffArea
        Areas from which rules exclude new posts, map coordinates.
    relief : Relief or None
        Ground under the map, which is flat, or level land next to ramps and underpasses; None if the height of the
        land is unknown.
    roundabouts : tuple of frozenset of str
        Junction ids of each roundabout in a network.
    map_source : str
        Source of the roads.
    widths_assumed : frozenset of str
        Groups of lanes (`road_surface.GROUPS`) in which some widths are assumed.
    attribution : tuple of str
        Credits required by the sources of the site.
    """

    name: str = ""
    map: Path | None = None
    near: tuple[float, float] | None = None
    junction: str | None = None
    radius: float | None = None
    approaches: float | None = None
    region: MultiPolygon | None = None
    level: tuple[str, ...] = ()
    weighted_regions: tuple[WeightedRegion, ...] = ()
    buildings: tuple[Building, ...] = ()
    trees: tuple[Trees, ...] = ()
    walls: tuple[Wall, ...] = ()
    street_lights: tuple[Poles, ...] = ()
    signal_poles: tuple[Poles, ...] = ()
    forbidden_areas: tuple[Area, ...] = ()
    mandatory_areas: tuple[Area, ...] = ()
    slabs: tuple[Slab, ...] = ()
    posts: tuple[Poles, ...] = ()
    ways: tuple[SideWay, ...] = ()
    keep_off_areas: tuple[KeepOffArea, ...] = ()
    relief: Relief | None = None
    roundabouts: tuple[frozenset[str], ...] = ()
    map_source: str = FROM_MAP
    widths_assumed: frozenset[str] = frozenset()
    attribution: tuple[str, ...] = ()

    @property
    def has_objects(self) -> bool:
        """Whether the description has any objects."""
        return any(getattr(self, name) for name in OBJECT_FIELDS)

    def with_objects_of(self, other: "SiteDescription") -> "SiteDescription":
        """Return this description with the objects, ways, areas and credits of another one added."""
        fields = (*OBJECT_FIELDS, "ways", "keep_off_areas", "attribution")
        both: dict[str, Any] = {name: (*getattr(self, name), *getattr(other, name)) for name in fields}
        return replace(self, **both | {"attribution": tuple(dict.fromkeys(both["attribution"]))})

    def with_attribution(self, credit: str) -> "SiteDescription":
        """Return this description with one more credit, if it is not empty."""
        return replace(self, attribution=(*self.attribution, credit)) if credit else self

    @property
    def along(self) -> float | None:
        """Length of the approaches in the region, metres; None if the region is a circle or an area."""
        if self.junction is None or self.region is not None or self.radius is not None:
            return None
        return DEFAULT_RADIUS if self.approaches is None else self.approaches
