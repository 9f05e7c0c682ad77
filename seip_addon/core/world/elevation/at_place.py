"""Ground at a place of a map, from an elevation model."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from shapely.geometry.base import BaseGeometry

from ...base.arrays import Float
from ...base.errors import SeipError
from ...geometry.geo_reference import GeoReference, TransverseMercator, projection
from ...geometry.height_raster import HeightRaster
from ...site.scene_geometry import HEIGHTS_FROM
from ..streetscape.description import SiteDescription
from ..streetscape.terrain import Relief
from .geotiff import GEOGRAPHIC, GeoTiff, read_geotiff

SMOOTHING = 4.0  # metres: standard deviation of the Gaussian that smooths heights, about the width of a lane
CELL, MAX_CELLS = 1.0, 1500  # metres of a cell, and cells along a side at most: larger places have larger ones
MIN_COVERED = 0.5  # least share of the place with known heights; otherwise the file belongs to a different place
FLAT, MIN_FLAT = 0.25, 0.6  # a map is flat if at least this share of its lanes is within this (metres) of one height
HORIZONTAL = {5554: 25831, 5555: 25832, 5556: 25833}
"""Code of each compound system with UTM, and of its horizontal part: heights are used unchanged."""
Transform = Callable[[Float], Float]


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
    """

    reference: GeoReference
    area: BaseGeometry
    lanes: Float


def with_terrain(
    description: SiteDescription, path: Path, around: MapSurroundings
) -> tuple[SiteDescription, tuple[str, ...]]:
    """Add ground heights to the description of a place with a flat map.

    Parameters
    ----------
    description : SiteDescription
        Description of the place.
    path : Path
        GeoTIFF with heights.
    around : MapSurroundings
        Map at the place.

    Returns
    -------
    description : SiteDescription
        Description with ground added.
    notes : tuple of str
        Messages about the source of the heights.

    Raises
    ------
    SeipError
        The file cannot be read or does not cover the place, or the map has heights.
    """
    level = float(np.median(around.lanes[:, 2])) if len(around.lanes) else 0.0
    if len(around.lanes) and np.mean(np.abs(around.lanes[:, 2] - level) <= FLAT) < MIN_FLAT:
        low, high = around.lanes[:, 2].min(), around.lanes[:, 2].max()
        raise SeipError(
            f"the map has its own heights there ({low:.1f} to {high:.1f} m), which its roads keep: leave out the "
            "terrain"
        )
    model = read_geotiff(path)
    smooth = _heights(model, around).smoothed(SMOOTHING)
    low, high = float(smooth.heights.min()), float(smooth.heights.max())
    note = f"{HEIGHTS_FROM}{path.name}, {low:.1f} to {high:.1f} m, smoothed by a Gaussian of {SMOOTHING:g} m"
    credited = description.with_attribution(model.copyright)
    return replace(credited, relief=Relief(smooth, level)), (note,)


def _heights(model: GeoTiff, around: MapSurroundings) -> HeightRaster:
    """Return the heights of a model at a place and within the margin that smoothing needs, in map coordinates."""
    from_map, to_degrees = _conversions(model, around.reference)
    low_x, low_y, high_x, high_y = around.area.buffer(4 * SMOOTHING).bounds
    step = max(CELL, max(high_x - low_x, high_y - low_y) / MAX_CELLS)
    shape = tuple(math.ceil((high - low) / step) + 1 for low, high in ((low_y, high_y), (low_x, high_x)))
    raster = HeightRaster(np.floor([low_x, low_y]), step, np.full(shape, np.nan))
    heights = model.at(from_map(raster.places)).reshape(shape)
    covered = float(np.isfinite(heights).mean())
    if covered < MIN_COVERED:
        middle = to_degrees(model.middle)[0]
        centre = around.area.centroid
        place = around.reference.geographic(np.array([[centre.x, centre.y, 0.0]]))
        here = "" if place is None else f", and the place is at latitude {place[0, 1]:.5f}, longitude {place[0, 0]:.5f}"
        raise SeipError(
            f"{model.name} has heights for {covered:.0%} of the place: its middle is at latitude {middle[1]:.5f}, "
            f"longitude {middle[0]:.5f}{here}; use a file that covers the place"
        )
    return replace(raster, heights=heights)


def _conversions(model: GeoTiff, reference: GeoReference) -> tuple[Transform, Transform]:
    """Return the conversions of places (n, 2) of a map to those of a model, and of these to longitude and latitude.

    Raises
    ------
    SeipError
        The map has no known position, or the system of the model is neither a UTM zone nor longitude and latitude.
    """
    mercator = reference.mercator
    if mercator is None:
        raise SeipError(
            f"{model.name} cannot be placed on the map: {reference.obstacle}; use a map with a <geoReference> of a UTM "
            "zone or a transverse Mercator projection, and no rotation"
        )
    system = projection(f"EPSG:{HORIZONTAL.get(model.epsg, model.epsg)}")
    if system is None and model.epsg not in GEOGRAPHIC:
        zone = round((math.degrees(mercator.longitude) + 183) / 6)
        raise SeipError(
            f"{model.name} is in EPSG:{model.epsg}: convert it to a UTM zone, here by "
            f"gdalwarp -t_srs EPSG:{32600 + zone} -r bilinear in.tif out.tif"
        )
    offset = np.array(reference.header_offset[:2])

    def from_map(places: Float) -> Float:
        moved: Float = places + offset
        if system == mercator:
            return moved
        degrees = _geographic(mercator, moved)
        return degrees if system is None else _projected(system, degrees)

    return from_map, lambda places: places if system is None else _geographic(system, places)


def _geographic(mercator: TransverseMercator, places: Float) -> Float:
    latitude, longitude = mercator.inverse(*places.T)
    return np.degrees(np.column_stack([longitude, latitude]))


def _projected(mercator: TransverseMercator, places: Float) -> Float:
    radians = np.radians(places)
    projected = [mercator(latitude, longitude) for longitude, latitude in radians.tolist()]
    return np.array(projected, dtype=np.float64).reshape(-1, 2)
