"""Buildings of a city model at a place of a map."""

import math
from collections.abc import Generator
from dataclasses import MISSING, dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...arrays import Float
from ...counts import counted
from ...errors import SeipError
from ...geometry.geo_reference import GeoReference
from ...geometry.plan import outline
from ...geometry.reference_systems import Transform, reprojection
from ...limits import ELEVATION, HEIGHT, MAP_COORDINATE, SITE_RADIUS
from ...progress import Progress
from ...settings import setting
from ...site.scene_geometry import FROM_CITY_MODEL
from ..streetscape.description import PlacedSolid, SiteDescription, without_covered_buildings
from ..streetscape.map_furniture import facade
from .cityjson import CityModel, read_city_model
from .solids import building_solid

BUILDINGS_PER_STEP = 50

_FAULTS = f"without area, wider than {SITE_RADIUS.most:,g} m or not {HEIGHT} high"
UNUSABLE = (f"building {_FAULTS} is", f"buildings {_FAULTS} are")
"""Reason to leave out a building, for one and for several."""


@dataclass(frozen=True)
class BuildingsRequest:
    """A requested city model and its position.

    Parameters
    ----------
    path : Path
        CityJSON file.
    epsg : int or None
        EPSG code of its reference system; None to use the one in the file.
    origin : (x, y, z) or None
        Map coordinates of its zero, metres, instead of a reference system; its heights are then used unchanged.
    """

    path: Path = setting(
        MISSING, "city model (CityJSON 1.1, 2.0) with buildings", option="buildings", metavar="CITYJSON"
    )
    epsg: int | None = setting(
        None, "coordinate system of the city model, if it names none", option="buildings-epsg", metavar="CODE"
    )
    origin: tuple[float, float, float] | None = setting(
        None,
        "map coordinates of the city model's origin, metres, if it has no coordinate system",
        option="buildings-origin",
        metavar=("X", "Y", "Z"),
    )


def with_city_model(
    description: SiteDescription, request: BuildingsRequest, reference: GeoReference, area: BaseGeometry
) -> Generator[Progress, None, tuple[SiteDescription, tuple[str, ...]]]:
    """Add the buildings of a city model to a description, replacing buildings of an extract that they cover.

    The lowest point of each building is put on the lowest ground under it, because heights of the model and of the map
    have different zeros.

    Parameters
    ----------
    description : SiteDescription
        Description to add to.
    request : BuildingsRequest
        City model.
    reference : GeoReference
        Position of the map on the Earth.
    area : shapely geometry
        Area of interest, map coordinates; buildings that reach into it are added.

    Returns
    -------
    description : SiteDescription
        Description with the buildings added.
    notes : tuple of str
        Messages about buildings left out or replaced.

    Raises
    ------
    SeipError
        The model cannot be read, cannot be placed on the map, or has no building there.
    """
    yield Progress(0, 0, f"reading {request.path.name}")
    model = read_city_model(request.path)
    to_map = _to_map(model, request, reference)
    model = replace(model, vertices=np.column_stack([to_map(model.vertices[:, :2]), model.vertices[:, 2]]))
    left_out = model.left_out
    shapely.prepare(area)
    low_x, low_y, high_x, high_y = area.bounds
    solids: list[PlacedSolid] = []
    for number, building in enumerate(model.buildings):
        if number % BUILDINGS_PER_STEP == 0:
            yield Progress(number, len(model.buildings), "buildings")
        used = model.vertices[np.concatenate([ring for surface in building.surfaces for ring in surface.rings])]
        (x, y, z), (far_x, far_y, top) = used.min(axis=0), used.max(axis=0)
        if not (x <= high_x and far_x >= low_x and y <= high_y and far_y >= low_y):
            continue
        solid = building_solid(model, building, facade(len(solids)))
        if solid is None or not HEIGHT.allow(top - z) or max(far_x - x, far_y - y) > SITE_RADIUS.most:
            left_out[UNUSABLE] += 1
            continue
        plan = _plan(solid.vertices, np.array(solid.faces))
        if not plan.intersects(area):
            continue
        raised = -float(solid.vertices[:, 2].min()) if request.origin is None else request.origin[2]
        solid = replace(solid, vertices=solid.vertices + np.array([0.0, 0.0, raised]))
        solids.append(PlacedSolid("Building", solid, plan, FROM_CITY_MODEL, on_ground=request.origin is None))
    if not solids:
        raise _elsewhere(request.path, model, reference, area)
    kept, dropped = without_covered_buildings(description, solids)
    notes = [f"{counted(number, *reason)} left out of {model.name}" for reason, number in left_out.items()]
    if dropped:
        notes.append(f"{counted(dropped, 'building')} of the extract replaced by those of the city model")
    return replace(kept, solids=(*kept.solids, *solids)).with_attribution(model.attribution), tuple(notes)


def _to_map(model: CityModel, request: BuildingsRequest, reference: GeoReference) -> Transform:
    if request.origin is not None:
        MAP_COORDINATE.require(request.origin[:2], "origin of the city model", "X or Y", "give map coordinates")
        ELEVATION.require(request.origin[2], "origin of the city model", "Z", "give a height above the map's zero")
        shift = np.array(request.origin[:2])
        return lambda xy: xy + shift
    code = request.epsg or model.epsg
    if code is None:
        raise SeipError(
            f"{model.name} names no reference system: give the EPSG code of the city model, or its origin in "
            "coordinates of the map, X Y Z"
        )
    return reprojection(code, reference, model.name).to_map


def _plan(vertices: Float, faces: Float) -> BaseGeometry:
    """Return the area of a solid in plan; for a solid of walls only, their convex hull."""
    area = outline(vertices[faces])
    return area if not area.is_empty else shapely.convex_hull(shapely.multipoints(vertices[:, :2]))


def _elsewhere(path: Path, model: CityModel, reference: GeoReference, area: BaseGeometry) -> SeipError:
    """Return an error that names the positions of a model and of the place."""
    x, y = np.median(model.vertices[:, :2], axis=0)
    place = area.centroid
    distance = math.dist((x, y), (place.x, place.y))
    where, there = f"map ({x:.0f}, {y:.0f})", f"map ({place.x:.0f}, {place.y:.0f})"
    degrees = reference.geographic(np.array([[x, y, 0.0], [place.x, place.y, 0.0]]))
    if degrees is not None and np.isfinite(degrees).all():
        where, there = (f"latitude {latitude:.5f}, longitude {longitude:.5f}" for longitude, latitude, _ in degrees)
    how_far = f"{distance / 1000:,.1f} km" if math.isfinite(distance) else "far"
    return SeipError(
        f"{path.name} has no building at the place: it lies about {where}, {how_far} from the place at {there}; use a "
        "model that covers the place"
    )
