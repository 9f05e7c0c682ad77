"""Scene geometry as plain arrays and polygons, without Blender types."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from ..base.arrays import Float
from ..geometry.geo_reference import GeoReference
from .post_rules import KeepOffArea, RuleName
from .sources import SourceCount, count_sources

DEFAULT_WEIGHT = 2.0
"""Weight of a weighted region that has none."""

DEFAULT_REFLECTIVITY = 0.3
"""Reflectivity of surfaces for which none is known."""

OTHER_LEVELS = "Roads on other levels"
"""Name of the ground made of roads on other levels than the studied one; plans show it."""

FROM_MAP, DESCRIBED, ASSUMED = "map", "site description", "assumed"
FROM_EXTRACT, FROM_SURVEY = "extract", "survey"
"""Source of an object: the map, the site description, an assumption, OpenStreetMap, a survey."""
HEIGHTS_FROM = "roads and ground take their heights from "
"""First words of the assumption that names a file of terrain; the file follows, then a comma."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """One object's evaluated surface.

    Parameters
    ----------
    name : str
        Name of the object, for messages.
    triangles : (n, 3, 3) float64, metres
        Triangles in local site axes, z up.
    reflectivity : (n,) float64, optional
        Share of the light (0 to 1) that each triangle scatters back; `DEFAULT_REFLECTIVITY` if not given.
    source : str
        Source of the object, as in `Pole`.
    height_assumed, width_assumed : bool
        Whether the source lacks its height, or its width, as for lanes.
    """

    name: str
    triangles: Float
    reflectivity: Float | None = None
    source: str = ""
    height_assumed: bool = False
    width_assumed: bool = False


def joined(meshes: Sequence[Mesh]) -> Float:
    """Return the triangles (n, 3, 3) of all meshes."""
    return np.concatenate([np.empty((0, 3, 3)), *(mesh.triangles for mesh in meshes)])


def ordered_surfaces(meshes: Sequence[Mesh]) -> tuple[Float, Float]:
    """Return the triangles of all meshes and their reflectivity, in an order independent of that of the meshes.

    Returns
    -------
    triangles : (n, 3, 3) float64, metres
    reflectivity : (n,) float64, 0 to 1
    """
    given = [
        np.full(len(mesh.triangles), DEFAULT_REFLECTIVITY) if mesh.reflectivity is None else mesh.reflectivity
        for mesh in meshes
    ]
    triangles, reflectivity = joined(meshes), np.concatenate([np.empty(0), *given])
    order = np.lexsort([reflectivity, *triangles.reshape(len(triangles), 9).T[::-1]])
    return triangles[order], reflectivity[order]


@dataclass(frozen=True, eq=False)
class Pole:
    """A post that can carry a sensor.

    Parameters
    ----------
    name : str
        Name of the object.
    base : (3,) float64, metres
        Foot of the post, local site axes.
    height : float or None, metres
        Height of the post; None if it is unknown, which allows any height of sensors.
    forbidden, mandatory : bool
        Whether the pole must carry no sensor, or at least one.
    source : str
        `FROM_MAP`, `DESCRIBED`, `ASSUMED` or `FROM_EXTRACT`; "" for poles that the user added to the scene.
    keep_off : str or None
        Rule that excludes sensors from the pole, unless it is allowed; None if there is none.
    """

    name: str
    base: Float
    height: float | None = None
    forbidden: bool = False
    mandatory: bool = False
    source: str = ""
    keep_off: RuleName | None = None


@dataclass(frozen=True, eq=False)
class NamedArea:
    """A named area in plan, local site axes in metres.

    Parameters
    ----------
    weight : float
        Weight of the targets in a weighted region.
    crossing, track : bool
        Whether a place of the map is a pedestrian crossing, or a track of trams or trains beside the streets.
    """

    name: str
    polygon: BaseGeometry
    weight: float = 1.0
    crossing: bool = False
    track: bool = False

    @property
    def street(self) -> bool:
        """Whether a place of the map is a street."""
        return not (self.crossing or self.track)


@dataclass(frozen=True, eq=False)
class SceneGeometry:
    """Geometry of a scene. All coordinates are local: metres, z up, right-handed.

    Parameters
    ----------
    name : str
        Name of the scene, for titles.
    origin : (3,) float64, metres
        Map coordinates of the local origin: map = local + origin.
    roads : tuple of Mesh
        Surfaces on which targets stand; rays end on them too.
    ground : tuple of Mesh
        Other surfaces that rays end on (pavements, verges); no targets.
    occluders : tuple of Mesh
        All other occluders (buildings, trees, poles).
    region : shapely geometry
        Region of interest in plan.
    weighted_regions, forbidden_areas, mandatory_areas : tuple of NamedArea
        Areas in plan. A weighted region multiplies the weight of the targets in it. At least one sensor must stand in
        each mandatory area.
    candidate_areas : shapely geometry
        Area in plan for new posts.
    poles : tuple of Pole
        Existing posts that can carry a sensor.
    keep_off_areas : tuple of KeepOffArea
        Areas in plan from which rules exclude new posts.
    geo_reference : GeoReference
        Position of the scene's map on the Earth.
    places : tuple of NamedArea
        Streets and crossings of the map in plan; used only to name them in results.
    attribution : tuple of str
        Credits required by the sources of the scene, which results repeat.
    assumptions : tuple of str
        Assumptions and omissions of the model of the map, which results repeat.

    Examples
    --------
    >>> import shapely
    >>> road = np.array([[(0, 0, 0), (40, 0, 0), (40, 8, 0)], [(0, 0, 0), (40, 8, 0), (0, 8, 0)]], dtype=float)
    >>> lanes = Mesh("Lane 1", road, source=FROM_MAP), Mesh("Lane 2", road + [0.0, 8.0, 0.0], source=FROM_MAP)
    >>> scene = SceneGeometry("street", np.zeros(3), lanes, (), (), region=shapely.box(0.0, 0.0, 40.0, 16.0))
    >>> joined(scene.roads).shape
    (4, 3, 3)
    >>> [(each.kind, each.source, each.count) for each in scene.sources()]
    [('Lane', 'map', 2)]
    """

    name: str
    origin: Float
    roads: tuple[Mesh, ...]
    ground: tuple[Mesh, ...]
    occluders: tuple[Mesh, ...]
    region: BaseGeometry
    candidate_areas: BaseGeometry = field(default_factory=Polygon)
    weighted_regions: tuple[NamedArea, ...] = ()
    forbidden_areas: tuple[NamedArea, ...] = ()
    mandatory_areas: tuple[NamedArea, ...] = ()
    poles: tuple[Pole, ...] = ()
    geo_reference: GeoReference = field(default_factory=GeoReference)
    places: tuple[NamedArea, ...] = ()
    attribution: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()
    keep_off_areas: tuple[KeepOffArea, ...] = ()

    def sources(self) -> tuple[SourceCount, ...]:
        """Count the surfaces with a known source, by kind and source."""
        return count_sources(
            (mesh.name, mesh.source, mesh.height_assumed or mesh.width_assumed or mesh.source == ASSUMED)
            for mesh in (*self.roads, *self.ground, *self.occluders)
            if mesh.source
        )
