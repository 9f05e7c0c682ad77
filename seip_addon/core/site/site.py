"""The site: targets, candidates and static triangles."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from shapely.geometry.base import BaseGeometry

from ..base.arrays import Float
from ..base.errors import SeipError
from ..geometry.geo_reference import GeoReference
from .candidates import Candidates, CandidateSettings, generate_candidates
from .far_objects import without_far_objects
from .scene_geometry import FROM_EXTRACT, HEIGHTS_FROM, SceneGeometry, joined, ordered_surfaces
from .sources import SourceCount
from .targets import Targets, generate_targets
from .yaws import with_yaws

__all__ = ["Candidates", "Site", "Targets", "make_site"]

ROAD_KIND = "Driving lanes"
LEVEL = 0.5  # metres between the road at the origin and zero in a model without heights
MOST_PAIRS = 10**9
"""Largest number of candidates times targets: a byte of memory for each, and several times that in a search."""
MOST_CANDIDATES = 40_000
"""Largest number of candidates: a search takes two bytes for each pair of them, to exclude those at one position."""


@dataclass(frozen=True, eq=False)
class Site:
    """Targets, candidates and static triangles of a site: the input of visibility and placement.

    Parameters
    ----------
    name : str
        Name of the scene.
    origin : (3,) float64, metres
        Map coordinates of the local origin: map = local + origin.
    region : shapely geometry
        Region of interest in plan, local.
    triangles : (n, 3, 3) float64, metres
        All static surfaces that a relevant ray can reach, roads included.
    reflectivity : (n,) float64, 0 to 1
        Reflectivity of each triangle.
    geo_reference : GeoReference
        Position of the scene's map on the Earth.
    sources : tuple of SourceCount
        Sources of the scene's surfaces.
    attribution : tuple of str
        Credits required by these sources.
    assumptions : tuple of str
        Assumptions and omissions of the model of the map.
    """

    name: str
    origin: Float
    region: BaseGeometry
    targets: Targets
    candidates: Candidates
    triangles: Float
    reflectivity: Float
    geo_reference: GeoReference = field(default_factory=GeoReference)
    sources: tuple[SourceCount, ...] = ()
    attribution: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()

    def geographic(self, points: Float) -> Float | None:
        """Return longitude, latitude (degrees, WGS 84) and height above the map's zero of local points, all (n, 3).

        None if the map's projection is not known.
        """
        return self.geo_reference.geographic(points + self.origin)

    @property
    def altitude_zero(self) -> str:
        """Level that altitudes count from, in words, as far as the scene knows it."""
        file = next((note.removeprefix(HEIGHTS_FROM) for note in self.assumptions if note.startswith(HEIGHTS_FROM)), "")
        if file:
            return f"the zero of the heights in {file.rpartition(' to ')[0].rpartition(', ')[0]}"
        from_extract = any(row.source == FROM_EXTRACT and row.kind == ROAD_KIND for row in self.sources)
        if from_extract and abs(self.origin[2]) < LEVEL:
            return "the ground of the model, which is level, as the extract has no heights above the sea"
        geoid = re.search(r"\+geoidgrids=(\S+)", self.geo_reference.projection)
        return (
            f"the zero of the map's heights{f' (geoid {geoid[1]})' if geoid else ', whose level the map does not give'}"
        )


def make_site(
    geometry: SceneGeometry,
    settings: CandidateSettings,
    grid_spacing: float = 1.0,
    reach: float = math.inf,
    fields_of_view: Mapping[str, float] = MappingProxyType({}),
) -> Site:
    """Make the site of a scene: its targets, candidates and static triangles.

    Parameters
    ----------
    grid_spacing : float, metres
        Distance between neighbouring targets.
    reach : float, metres
        Distance from the region beyond which surfaces are left out, because no relevant ray reaches them.
    fields_of_view : mapping of str to float, radians
        Horizontal field of view of each sensor type; types that are missing see the full circle.

    Returns
    -------
    Site
        Site, independent of the names of objects and of their order.

    Raises
    ------
    SeipError
        There is no road, no target or no candidate, or more of both than fit in memory.

    Examples
    --------
    A street of 40 by 10 m with a lamp 1 m beside it, whose bracket brings the sensor 0.4 m nearer:

    >>> import numpy as np
    >>> import shapely
    >>> from seip_addon.core.site.scene_geometry import Mesh, Pole
    >>> corners = np.array([[-20.0, -5.0, 0.0], [20.0, -5.0, 0.0], [20.0, 5.0, 0.0], [-20.0, 5.0, 0.0]])
    >>> street = Mesh("street", corners[[[0, 1, 2], [0, 2, 3]]])
    >>> lamp = Pole("lamp", np.array([0.0, 6.0, 0.0]))
    >>> region = shapely.box(-20, -5, 20, 5)
    >>> geometry = SceneGeometry("Mill Lane", np.zeros(3), (street,), (), (), region, poles=(lamp,))
    >>> site = make_site(geometry, CandidateSettings(heights=(5.0, 8.0)), grid_spacing=2.0)
    >>> len(site.targets), site.candidates.xyz.round(3).tolist()
    (100, [[0.0, 5.6, 5.0], [0.0, 5.6, 8.0]])
    """
    if not geometry.roads:
        raise SeipError("there is no road: put the meshes of the carriageway into SEIP Roads")
    road = joined(geometry.roads)
    near, _ = without_far_objects(geometry, geometry.region, reach)
    triangles, reflectivity = ordered_surfaces((*near.roads, *near.ground, *near.occluders))
    targets = generate_targets(geometry.region, road, grid_spacing, geometry.weighted_regions)
    one_way = any(angle < math.tau for angle in fields_of_view.values())
    most = min(MOST_PAIRS / max(1, len(targets)), MOST_CANDIDATES) / (settings.yaws if one_way else 1)
    candidates = generate_candidates(geometry, settings, most)
    return Site(
        name=geometry.name,
        origin=geometry.origin,
        region=geometry.region,
        targets=targets,
        candidates=with_yaws(candidates, fields_of_view, settings.yaws, geometry.region, targets.xyz),
        triangles=triangles,
        reflectivity=reflectivity,
        geo_reference=geometry.geo_reference,
        sources=geometry.sources(),
        attribution=geometry.attribution,
        assumptions=geometry.assumptions,
    )
