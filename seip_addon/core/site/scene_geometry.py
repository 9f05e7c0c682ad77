"""Scene geometry as plain arrays and polygons, without Blender types."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from ..arrays import Float
from ..geometry.geo_reference import GeoReference
from .post_rules import KeepOffArea, RuleName
from .sources import SourceCount, count_sources

DEFAULT_WEIGHT = 2.0
"""Of a weighted region that does not say its own."""

DEFAULT_REFLECTIVITY = 0.3
"""Of a surface that is not known to reflect otherwise."""

OTHER_LEVELS = "Roads on other levels"
"""Name of the ground that is roads of other levels than the studied one; plans show it."""

FROM_MAP, DESCRIBED, ASSUMED = "map", "site description", "assumed"
FROM_EXTRACT, FROM_CITY_MODEL, FROM_SURVEY = "extract", "city model", "survey"
FROM_MESH = "mesh file"
"""Source of an object: the map, the site description, an assumption, OpenStreetMap, a city model, a survey, a mesh."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """One object's evaluated surface.

    Parameters
    ----------
    name : str
        The object's name, for messages.
    triangles : (n, 3, 3) float64, metres
        Corners in local site axes, z up.
    reflectivity : (n,) float64, optional
        Share of the light (0 to 1) that each triangle scatters back; `DEFAULT_REFLECTIVITY` where not given.
    source : str
        Who says that it is there, as of a `Pole`.
    height_assumed, width_assumed : bool
        Whether that source does not give its height, or its width, as of lanes.
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
    """Return the triangles of all meshes and the reflectivity of each, in an order that no order of meshes changes.

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
        The object's name.
    base : (3,) float64, metres
        Foot of the post, local site axes.
    height : float or None, metres
        Top of the post above its foot; None where that is not known, and any height will do.
    forbidden, mandatory : bool
        No sensor may hang here; at least one sensor must.
    source : str
        `FROM_MAP`, `DESCRIBED`, `ASSUMED` or `FROM_EXTRACT`; empty where the user put it into the scene.
    keep_off : str or None
        Rule that keeps sensors off the pole, unless it is allowed; None where none does.
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
    crossing : bool
        Whether a place of the map is a pedestrian crossing.
    """

    name: str
    polygon: BaseGeometry
    weight: float = 1.0
    crossing: bool = False


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
        In plan. A weighted region multiplies the weight of the targets in it.
        At least one sensor must stand in each mandatory area.
    candidate_areas : shapely geometry
        Where a new post may stand, in plan.
    poles : tuple of Pole
        Existing posts that can carry a sensor.
    keep_off_areas : tuple of KeepOffArea
        Where rules keep new posts off, in plan.
    geo_reference : GeoReference
        Where on the Earth the scene's map is.
    places : tuple of NamedArea
        Streets and crossings of the map, in plan: results name them, and nothing else depends on them.
    attribution : tuple of str
        Credits that the sources of the scene demand; results carry them.
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
    keep_off_areas: tuple[KeepOffArea, ...] = ()

    def sources(self) -> tuple[SourceCount, ...]:
        """Count the surfaces of which the scene says where they come from, by kind and source."""
        return count_sources(
            (mesh.name, mesh.source, mesh.height_assumed or mesh.width_assumed or mesh.source == ASSUMED)
            for mesh in (*self.roads, *self.ground, *self.occluders)
            if mesh.source
        )
