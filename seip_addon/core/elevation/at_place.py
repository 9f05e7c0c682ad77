"""The ground at a place of a map, from an elevation model or a laser survey."""

import math
from collections.abc import Generator
from dataclasses import replace
from pathlib import Path

import numpy as np
from shapely.geometry.base import BaseGeometry

from ..arrays import Float
from ..errors import SeipError
from ..geometry.height_raster import HeightRaster
from ..opendrive.geo_reference import GeoReference
from ..opendrive.reference_systems import reprojection
from ..progress import Progress
from ..streetscape.description import SiteDescription
from ..streetscape.terrain import Relief
from .geotiff import GeoTiff, read_geotiff

SMOOTHING = 4.0  # metres: standard deviation of the Gaussian that heights are smoothed by, about a lane's width
CELL, MAX_CELLS = 1.0, 1500  # metres of a cell, and cells along a side at most: larger places have larger ones
MIN_COVERED = 0.5  # share of the place of which heights are known, below which a model is that of another place
FLAT, MIN_FLAT = 0.25, 0.6  # a map is flat where such a share of its lanes is within this (metres) of one height


def with_terrain(
    description: SiteDescription, path: Path, reference: GeoReference, area: BaseGeometry, lanes: Float
) -> Generator[Progress, None, tuple[SiteDescription, tuple[str, ...]]]:
    """Lay the flat map of a place on the ground.

    Parameters
    ----------
    path : Path
        GeoTIFF.
    reference : GeoReference
        Of the map.
    area : shapely geometry
        Of the place, map coordinates.
    lanes : (n, 3) float64, metres
        Points of the map's lanes there.

    Returns
    -------
    description : SiteDescription
    notes : tuple of str

    Raises
    ------
    SeipError
        The file cannot be read, does not cover the place, or the map has heights of its own.
    """
    yield Progress(0, 0, f"reading {path.name}")
    level, is_flat = _level(lanes)
    if not is_flat:
        low, high = lanes[:, 2].min(), lanes[:, 2].max()
        raise SeipError(
            f"the map has heights of its own there ({low:.1f} to {high:.1f} m), which its roads keep: leave out "
            "--terrain"
        )
    ground = _of_model(read_geotiff(path), reference, area)
    smooth = ground.smoothed(SMOOTHING)
    low, high = float(smooth.heights.min()), float(smooth.heights.max())
    note = (
        f"roads and ground take their heights from {path.name}, {low:.1f} to {high:.1f} m, smoothed by a Gaussian of "
        f"{SMOOTHING:g} m; the map itself stays flat"
    )
    return replace(description, relief=Relief(smooth, level)), (note,)


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
        (longitude, latitude) = system.to_geographic(model.middle)[0]
        where = area.centroid
        place = reference.geographic(np.array([[where.x, where.y, 0.0]]))
        there = (
            "" if place is None else f", and the place is at latitude {place[0, 1]:.5f}, longitude {place[0, 0]:.5f}"
        )
        raise SeipError(
            f"{model.name} has heights for {covered:.0%} of the place: its middle is at latitude {latitude:.5f}, "
            f"longitude {longitude:.5f}{there}; take the model of the place"
        )
    return replace(raster, heights=heights)


def empty_raster(area: BaseGeometry) -> HeightRaster:
    """Return a raster over an area and what smoothing needs around it, without heights."""
    low_x, low_y, high_x, high_y = area.buffer(4 * SMOOTHING).bounds
    step = max(CELL, max(high_x - low_x, high_y - low_y) / MAX_CELLS)
    shape = tuple(math.ceil((high - low) / step) + 1 for low, high in ((low_y, high_y), (low_x, high_x)))
    return HeightRaster(np.floor([low_x, low_y]), step, np.full(shape, np.nan))
