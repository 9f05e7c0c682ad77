"""Ground at a place of a map, from an elevation model or a laser survey."""

import math
from collections.abc import Generator
from dataclasses import MISSING, dataclass, field, replace
from pathlib import Path

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Boolean, Float, Integer
from ...base.counts import counted
from ...base.errors import SeipError
from ...base.progress import Progress
from ...base.settings import setting
from ...geometry.geo_reference import GeoReference
from ...geometry.height_raster import HeightRaster
from ...geometry.plan import outline
from ...geometry.reference_systems import reprojection
from ...geometry.solids import Solid
from ...site.scene_geometry import FROM_SURVEY, HEIGHTS_FROM
from ..streetscape.description import PlacedSolid, SiteDescription, without_covered_buildings
from ..streetscape.terrain import Relief
from .geotiff import GeoTiff, read_geotiff
from .obstacles import (
    KINDS,
    MIN_ABOVE,
    RAYS,
    UNCLASSIFIED,
    chosen_boxes,
    obstacle_raster,
    solids,
)
from .point_cloud import is_survey, read_points, survey_system

SMOOTHING = 4.0  # metres: standard deviation of the Gaussian that smooths heights, about the width of a lane
CELL, MAX_CELLS = 1.0, 1500  # metres of a cell, and cells along a side at most: larger places have larger ones
POINTS_PER_CELL, MAX_CELL = 2.0, 5.0  # least mean number of survey points in a cell, and largest cell in metres
GROUND = 2  # class of ground points in a survey
TRAFFIC_MARGIN = 1.0  # metres around the carriageway within which unclassified points are traffic
MIN_COVERED = 0.5  # least share of the place with known heights; otherwise the file belongs to a different place
FLAT, MIN_FLAT = 0.25, 0.6  # a map is flat if at least this share of its lanes is within this (metres) of one height
_SEED = 20_241


@dataclass(frozen=True)
class TerrainRequest:
    """A requested file of ground heights.

    Parameters
    ----------
    path : Path
        GeoTIFF, LAS or LAZ file.
    epsg : int or None
        EPSG code of a survey's reference system; None to use the one in the file.
    """

    path: Path = setting(
        MISSING,
        "ground for a flat map: GeoTIFF, or a survey (LAS, LAZ), whose objects are added too",
        option="terrain",
        metavar="FILE",
    )
    epsg: int | None = setting(
        None, "coordinate system of a survey, if it names none", option="terrain-epsg", metavar="CODE"
    )


@dataclass(frozen=True, eq=False)
class MapSurroundings:
    """Data of a map that the ground at a place depends on, map coordinates.

    Parameters
    ----------
    reference : GeoReference
        Position of the map on the Earth.
    area : shapely geometry
        Area of the place.
    lanes : (n, 3) float64, metres
        Points of the map's lanes there.
    carriageway : shapely geometry
        Area in which unclassified points of a survey are traffic.
    """

    reference: GeoReference
    area: BaseGeometry
    lanes: Float
    carriageway: BaseGeometry = field(default_factory=Polygon)


def with_terrain(
    description: SiteDescription, request: TerrainRequest, around: MapSurroundings
) -> Generator[Progress, None, tuple[SiteDescription, tuple[str, ...]]]:
    """Add ground heights to the description of a place with a flat map, and the objects of a survey.

    A map with heights keeps them; from a survey only the objects are added.

    Parameters
    ----------
    description : SiteDescription
        Description of the place.
    request : TerrainRequest
        File of heights.
    around : MapSurroundings
        Map at the place.

    Returns
    -------
    description : SiteDescription
        Description with ground and objects added.
    notes : tuple of str
        Messages about the sources of heights and objects.

    Raises
    ------
    SeipError
        The file cannot be read or does not cover the place; or it is an elevation model, and the map has heights.
    """
    path = request.path
    yield Progress(0, 0, f"reading {path.name}")
    level, is_flat = _level(around.lanes)
    if not is_flat and not is_survey(path):
        low, high = around.lanes[:, 2].min(), around.lanes[:, 2].max()
        raise SeipError(
            f"the map has its own heights there ({low:.1f} to {high:.1f} m), which its roads keep: leave out the "
            "terrain"
        )
    if not is_survey(path):
        model = read_geotiff(path)
        smooth = _of_model(model, around.reference, around.area).smoothed(SMOOTHING)
        credited = description.with_attribution(model.copyright)
        return replace(credited, relief=Relief(smooth, level)), (_heights_note(path, smooth),)
    points, classes = yield from _survey_points(request, around)
    smooth = _surveyed_ground(points, classes, around.area, path.name).smoothed(SMOOTHING)
    yield Progress(0, 0, "boxes of the survey")
    standing = _standing(points, classes, around)
    raster = obstacle_raster(smooth, points[standing], classes[standing])
    boxes, changed = chosen_boxes(raster, np.random.default_rng(_SEED))
    # A map with heights may use a different zero: objects move by the median difference between lanes and ground.
    raised = 0.0 if is_flat else float(np.median(around.lanes[:, 2] - smooth.at(around.lanes[:, :2])))
    added = tuple(_placed(name, solid, raised) for name, solid in solids(raster, boxes))
    description, dropped = without_covered_buildings(description, added)
    notes = [_heights_note(path, smooth)] if is_flat else [f"the map keeps its own heights, not those of {path.name}"]
    if boxes:
        cells = int((raster.kind >= 0).sum())
        stand = counted(len(boxes), "box stands", "boxes stand")
        notes.append(
            f"{stand} for {counted(cells, 'cell')} of {smooth.step:g} m with objects above {MIN_ABOVE:g} m in "
            f"{path.name}: this changes {changed:.2%} of {RAYS:,} random lines of sight"
        )
    if dropped:
        notes.append(f"{counted(dropped, 'building')} of the extract replaced by those of the survey")
    relief = Relief(smooth, level) if is_flat else None
    return replace(description, relief=relief, solids=(*description.solids, *added)), tuple(notes)


def _heights_note(path: Path, smooth: HeightRaster) -> str:
    low, high = float(smooth.heights.min()), float(smooth.heights.max())
    return f"{HEIGHTS_FROM}{path.name}, {low:.1f} to {high:.1f} m, smoothed by a Gaussian of {SMOOTHING:g} m"


def _survey_points(
    request: TerrainRequest, around: MapSurroundings
) -> Generator[Progress, None, tuple[Float, Integer]]:
    """Return the points of a survey at a place (n, 3), in map coordinates in plan, and their classes (n,)."""
    path = request.path
    named, middle = survey_system(path)
    code = request.epsg or named
    if code is None:
        raise SeipError(f"{path.name} names no reference system: give the EPSG code of the terrain")
    system = reprojection(code, around.reference, path.name)
    raster = empty_raster(around.area)
    corners = system.from_map(raster.places)
    cloud = yield from read_points(path, corners.min(axis=0), corners.max(axis=0))
    if not len(cloud.points):
        raise _elsewhere(path.name, 0.0, system.to_geographic(middle)[0], around.reference, around.area)
    if not (cloud.classes == GROUND).any():
        raise SeipError(
            f"{path.name} has no points of class 2 (ground) at the place: classify it (pdal translate in.laz out.laz "
            "smrf), or give an elevation model as GeoTIFF"
        )
    return np.column_stack([system.to_map(cloud.points[:, :2]), cloud.points[:, 2]]), cloud.classes


def _surveyed_ground(points: Float, classes: Integer, area: BaseGeometry, name: str) -> HeightRaster:
    """Return a raster with the mean height of ground points in each cell, NaN in cells without any."""
    raster = empty_raster(area, points)
    rows, columns = raster.heights.shape
    column, row = np.floor((points[:, :2] - raster.low) / raster.step + 0.5).astype(np.int64).T
    inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    cell, is_ground = row * columns + column, inside & (classes == GROUND)
    covered = float(np.mean(np.bincount(cell[inside], minlength=rows * columns) > 0))
    if covered < MIN_COVERED:
        raise SeipError(f"{name} has points on {covered:.0%} of the place: use a survey that covers all of it")
    count = np.bincount(cell[is_ground], minlength=rows * columns)
    total = np.bincount(cell[is_ground], points[is_ground, 2], minlength=rows * columns)
    heights = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return replace(raster, heights=heights.reshape(rows, columns))


def _standing(points: Float, classes: Integer, around: MapSurroundings) -> Boolean:
    """Return which points belong to objects, excluding traffic."""
    road = around.carriageway.buffer(TRAFFIC_MARGIN)
    shapely.prepare(road)
    traffic: Boolean = np.isin(classes, UNCLASSIFIED) & shapely.contains_xy(road, points[:, :2])
    return ~traffic


def _placed(name: str, solid: Solid, raised: float) -> PlacedSolid:
    plan = outline(solid.vertices[[face[:3] for face in solid.faces]])
    boxes = shapely.union_all([plan, outline(solid.vertices[[(face[0], *face[2:]) for face in solid.faces]])])
    moved = replace(solid, vertices=solid.vertices + np.array([0.0, 0.0, raised]))
    return PlacedSolid(name, moved, boxes, FROM_SURVEY, is_building=name == KINDS[-1])


def _level(lanes: Float) -> tuple[float, bool]:
    """Return the height of a flat map, and whether it is flat."""
    level = float(np.median(lanes[:, 2])) if len(lanes) else 0.0
    return level, bool(np.mean(np.abs(lanes[:, 2] - level) <= FLAT) >= MIN_FLAT) if len(lanes) else True


def _of_model(model: GeoTiff, reference: GeoReference, area: BaseGeometry) -> HeightRaster:
    system = reprojection(model.epsg, reference, model.name)
    raster = empty_raster(area)
    places = raster.places
    heights = model.at(system.from_map(places)).reshape(raster.heights.shape)
    covered = float(np.isfinite(heights).mean())
    if covered < MIN_COVERED:
        raise _elsewhere(model.name, covered, system.to_geographic(model.middle)[0], reference, area)
    return replace(raster, heights=heights)


def _elsewhere(name: str, covered: float, middle: Float, reference: GeoReference, area: BaseGeometry) -> SeipError:
    """Return an error that names the position of a file, by its middle (longitude, latitude), and of the place."""
    place = reference.geographic(np.array([[area.centroid.x, area.centroid.y, 0.0]]))
    there = "" if place is None else f", and the place is at latitude {place[0, 1]:.5f}, longitude {place[0, 0]:.5f}"
    return SeipError(
        f"{name} has heights for {covered:.0%} of the place: its middle is at latitude {middle[1]:.5f}, longitude "
        f"{middle[0]:.5f}{there}; use a file that covers the place"
    )


def empty_raster(area: BaseGeometry, points: Float | None = None) -> HeightRaster:
    """Return a raster without heights over an area and the margin that smoothing needs.

    If points (n, 3) are given, cells are large enough to hold about `POINTS_PER_CELL` points each.
    """
    low_x, low_y, high_x, high_y = area.buffer(4 * SMOOTHING).bounds
    size = max(high_x - low_x, high_y - low_y)
    step = max(CELL, size / MAX_CELLS)
    if points is not None:
        apart = math.sqrt(POINTS_PER_CELL * (high_x - low_x) * (high_y - low_y) / max(len(points), 1))
        step = min(max(step, round(2 * apart) / 2), MAX_CELL)
    shape = tuple(math.ceil((high - low) / step) + 1 for low, high in ((low_y, high_y), (low_x, high_x)))
    return HeightRaster(np.floor([low_x, low_y]), step, np.full(shape, np.nan))
