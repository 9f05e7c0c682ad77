"""Elevation models written by hand as GeoTIFF."""

import numpy as np
from PIL import Image, TiffImagePlugin

from seip_addon.core.geometry.geo_reference import projection

SCALE, TIE_POINT, TRANSFORMATION, KEYS, NO_DATA, COPYRIGHT = 33550, 33922, 34264, 34735, 42113, 33432


def write_dem(
    path, heights, west, north, step=1.0, epsg=25833, *, point=False, no_data=None, leave_out=(), keys=None, credit=None
):
    """Write heights (rows, columns) from north to south, whose upper left corner is at (west, north)."""
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    dx, dy = np.broadcast_to(step, 2).tolist()
    tags.tagtype[SCALE] = tags.tagtype[TIE_POINT] = 12
    tags.tagtype[KEYS], tags.tagtype[NO_DATA] = 3, 2
    own = 2048 if epsg in (4326, 4258) else 3072
    directory = [1024, 0, 1, 2 if own == 2048 else 1, 1025, 0, 1, 2 if point else 1, own, 0, 1, epsg, *(keys or [])]
    values = {
        SCALE: (dx, dy, 0.0),
        TIE_POINT: (0.0, 0.0, 0.0, float(west), float(north), 0.0),
        KEYS: (1, 1, 0, len(directory) // 4, *directory),
        NO_DATA: None if no_data is None else str(no_data),
        COPYRIGHT: credit,
    }
    for tag, value in values.items():
        if value is not None and tag not in leave_out:
            tags[tag] = value
    Image.fromarray(np.asarray(heights)).save(path, format="TIFF", tiffinfo=tags)
    return path


def sampled(surface, west, north, size, step=1.0):
    """Return heights (size, size) of a surface z(x, y) at the middles of pixels, as float32."""
    x = west + step * (np.arange(size) + 0.5)
    y = north - step * (np.arange(size) + 0.5)
    return np.asarray(surface(*np.meshgrid(x, y)), dtype=np.float32)


def origin_at(latitude, longitude, zone="EPSG:25833", height=30.0):
    """Return easting, northing and a height (3,) at a place, whole metres."""
    east, north = projection(zone)(np.radians(latitude), np.radians(longitude))
    return (round(east), round(north), height)
