"""GeoTIFF elevation models, read with Pillow (OGC GeoTIFF 1.1, 19-008r4)."""

import struct
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, UnidentifiedImageError

from ...base.arrays import Float
from ...base.errors import SeipError
from ...base.limits import GROUND, LATITUDE, LONGITUDE, MAP_COORDINATE, Limits
from ...geometry.height_raster import bilinear
from ...site.sources import one_line

GEOGRAPHIC = (4326, 4258)
"""EPSG codes of longitude and latitude in degrees, on WGS 84 and on ETRS89."""
MAX_PIXELS = 150_000_000
MAX_PIXELS_PER_BYTE = 1032  # in compressed files: more than DEFLATE achieves with pixels of any type
SMALL = 1_000_000
"""Number of pixels that is accepted for a file of any size."""
_SCALE, _TIE_POINT, _TRANSFORMATION, _KEYS, _NO_DATA, _COPYRIGHT = 33550, 33922, 34264, 34735, 42113, 33432
_RASTER_TYPE, _GEOGRAPHIC, _PROJECTED, _LINEAR_UNIT, _VERTICAL_UNIT = 1025, 2048, 3072, 3076, 4099
PIXEL = Limits(1e-9, 1e5)
"""Distance between neighbouring pixels, metres or degrees."""
_METRE, _NOT_SAID, _OWN = 9001, 0, 32767
_BROKEN = (OSError, SyntaxError, ValueError, TypeError, KeyError, IndexError, struct.error, EOFError, OverflowError)
"""Exceptions that Pillow raises for damaged files."""
_TAGS = (_SCALE, _TIE_POINT, _TRANSFORMATION, _KEYS, _NO_DATA, _COPYRIGHT)
_CONVERT = (
    "write it again (gdal_translate -co COMPRESS=DEFLATE -co PREDICTOR=1 in.tif out.tif, or gdalwarp -t_srs EPSG:…)"
)
_PROJECTED_CODES = Limits(1024, 32766)
"""EPSG codes that a GeoTIFF key may contain."""


@dataclass(frozen=True, eq=False)
class GeoTiff:
    """An elevation model.

    Parameters
    ----------
    name : str
        Name of its file.
    epsg : int
        EPSG code of its reference system.
    corner : (2,) float64
        Centre of the first pixel: metres, or degrees of longitude and latitude.
    step : (2,) float64
        Distance to the next pixel in the east, and in the south.
    heights : (rows, columns) float64, metres
        Heights from north to south; NaN for none.
    copyright : str
        Text of the file's Copyright tag, or "".
    """

    name: str
    epsg: int
    corner: Float
    step: Float
    heights: Float
    copyright: str = ""

    def at(self, places: Float) -> Float:
        """Return heights (n,) at places (n, 2) of its reference system, metres; NaN beyond its edge."""
        with np.errstate(invalid="ignore"):
            column, row = ((places - self.corner) / (self.step * [1, -1])).T
            rows, columns = self.heights.shape
            inside = (column >= -0.5) & (column <= columns - 0.5) & (row >= -0.5) & (row <= rows - 0.5)
        found = np.full(len(places), np.nan)
        row, column = np.clip(row[inside], 0, rows - 1), np.clip(column[inside], 0, columns - 1)
        found[inside] = bilinear(self.heights, row, column)
        return found

    @property
    def middle(self) -> Float:
        """Centre of the model, (1, 2)."""
        rows, columns = self.heights.shape
        middle: Float = self.corner + self.step * [1, -1] * np.array([columns - 1, rows - 1]) / 2
        return middle[None]


def read_geotiff(path: Path) -> GeoTiff:
    """Read an elevation model with one band of heights in metres.

    Raises
    ------
    SeipError
        The file cannot be read, is too large, or has no supported georeference or no heights.
    """
    name = path.name
    if not path.is_file():
        raise SeipError(f"no such file: {path}; check its path")
    Image.init()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(path, formats=["TIFF"]) as picture:
                if picture.width * picture.height > MAX_PIXELS:
                    raise _too_large(name)
                if picture.width * picture.height > max(MAX_PIXELS_PER_BYTE * path.stat().st_size, SMALL):
                    raise SeipError(f"{name} has far fewer bytes than its number of pixels needs: write it again")
                tags = {number: picture.tag_v2.get(number) for number in _TAGS}  # type: ignore[attr-defined]
                bands = len(picture.getbands())
                values = np.asarray(picture, dtype=np.float64)
    except Image.DecompressionBombError as error:
        raise _too_large(name) from error
    except UnidentifiedImageError as error:
        raise SeipError(
            f"{name} is not a TIFF file: convert it to GeoTIFF (gdal_translate in dem.tif; for LAS and LAZ with "
            "pdal, see docs/sources.md)"
        ) from error
    except _BROKEN as error:
        raise SeipError(f"{name} is a TIFF that cannot be read ({str(error)[:80]}); {_CONVERT}") from error
    if bands != 1 or values.ndim != 2 or min(values.shape) < 2:
        raise SeipError(f"{name} is a picture, not an elevation model: give a file with one band of heights")
    try:
        epsg, corner, step = _placed(tags, values.shape)
        no_data = tags[_NO_DATA]
        empty = values == float(str(no_data).strip(" \0")) if no_data is not None else np.zeros(values.shape, bool)
    except _BROKEN as error:
        raise SeipError(
            f"{name} {error if isinstance(error, _UnplacedError) else 'has damaged tags'}; {_CONVERT}"
        ) from error
    with np.errstate(invalid="ignore"):
        values[empty | ~((values >= GROUND.least) & (values <= GROUND.most))] = np.nan
    if not np.isfinite(values).any():
        raise SeipError(f"{name} has no height between {GROUND.least:g} and {GROUND.most:g} m: give heights in metres")
    return GeoTiff(name, epsg, corner, step, values, one_line(str(tags[_COPYRIGHT] or "")))


class _UnplacedError(ValueError):
    """Reason why a file has no usable georeference."""


def _too_large(name: str) -> SeipError:
    return SeipError(
        f"{name} has more than {MAX_PIXELS / 1e6:.0f} million pixels: cut the place out of it "
        "(gdal_translate -projwin west north east south)"
    )


def _placed(tags: dict[int, Any], shape: tuple[int, ...]) -> tuple[int, Float, Float]:
    """Return the EPSG code, the centre of the first pixel and the distances between pixels."""
    rows, columns = shape
    if tags[_TRANSFORMATION] is not None:
        matrix = np.array(tags[_TRANSFORMATION], dtype=np.float64).reshape(4, 4)
        if matrix[0, 1] or matrix[1, 0]:
            raise _UnplacedError("is rotated against its reference system")
        step, corner = np.array([matrix[0, 0], -matrix[1, 1]]), matrix[:2, 3]
    elif tags[_SCALE] is not None and tags[_TIE_POINT] is not None:
        step = np.array(tags[_SCALE][:2], dtype=np.float64)
        column, row, _, x, y = tags[_TIE_POINT][:5]
        corner = np.array([x, y], dtype=np.float64) - step * [column, -row]
    else:
        raise _UnplacedError("has no georeference (ModelTiepoint and ModelPixelScale)")
    if not (MAP_COORDINATE.allow([corner, corner + step * [columns, -rows]]) and PIXEL.allow(step)):
        raise _UnplacedError("has a georeference that lies nowhere on Earth")
    directory = list(tags[_KEYS] or ())
    keys = {directory[i]: directory[i + 3] for i in range(4, len(directory) - 3, 4) if directory[i + 1] == 0}
    code = keys.get(_PROJECTED, keys.get(_GEOGRAPHIC))
    if code is None or code == _OWN:
        raise _UnplacedError("names no reference system by an EPSG code")
    for unit in (_LINEAR_UNIT, _VERTICAL_UNIT):
        if keys.get(unit, _NOT_SAID) not in (_NOT_SAID, _METRE):
            raise _UnplacedError("is not in metres")
    if not _PROJECTED_CODES.allow(code):
        raise _UnplacedError("names no reference system by an EPSG code")
    if (_PROJECTED not in keys or code in GEOGRAPHIC) and not (
        LONGITUDE.allow(corner[0]) and LATITUDE.allow(corner[1])
    ):
        raise _UnplacedError("has a georeference that lies nowhere on Earth")
    # PixelIsArea (the default) places the corner of a pixel, PixelIsPoint its centre.
    is_point = keys.get(_RASTER_TYPE) == 2
    return int(code), corner if is_point else corner + step * [0.5, -0.5], step
