"""Bird's-eye picture of one frame: returns, sensors and detected boxes, drawn fast enough for every sweep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from PIL import Image, ImageColor, ImageDraw, ImageFont
from shapely.geometry.base import BaseGeometry

from seip_addon.core.base.arrays import Boolean, Float
from seip_addon.core.output.pictures.drawing import box_corners
from seip_addon.core.output.pictures.palette import INK, PAPER, SENSOR_BODY, SOFT_INK

BOX_COLOURS: Mapping[str, str] = {
    "car": "#d6358c",
    "truck": "#2c72a8",
    "motorcycle": "#e8823c",
    "pedestrian": "#00875a",
}
"""Colours of boxes by category."""

_SIDE = 1080  # pixels, divisible by two as video needs it
_HEADER = 40
_STATIC, _MOVING, _REGION = "#c9d0d5", INK, "#8ea3b0"

_Font = ImageFont.FreeTypeFont | ImageFont.ImageFont


def draw_birds_eye(  # noqa: PLR0913  # all that a picture shows
    points: NDArray[np.float32],
    foreground: Boolean,
    bounds: tuple[float, float, float, float],
    *,
    boxes: Float,
    categories: Sequence[str],
    sensors: Float,
    region: BaseGeometry,
    title: str,
) -> Image.Image:
    """Draw a frame in plan, north up.

    Parameters
    ----------
    points : (n, 3) float32, metres
    foreground : (n,) bool
        Returns that are nearer than the background, drawn dark.
    bounds : west, south, east, north, metres
    boxes : (k, 7) float64
        x, y, z of the middle, length, width, height (metres), yaw (radians).
    categories : sequence of str
        Category of each box.
    sensors : (s, 3) float64, metres
    region : shapely geometry, metres
        Region in which road users are detected, drawn as an outline.
    """
    west, south, east, north = bounds
    scale = min(_SIDE / (east - west), (_SIDE - _HEADER) / (north - south))

    def pixels(xy: Float) -> Float:
        return np.column_stack([(xy[:, 0] - west) * scale, _HEADER + (north - xy[:, 1]) * scale])

    raster = np.empty((_SIDE, _SIDE, 3), dtype=np.uint8)
    raster[:] = ImageColor.getrgb(PAPER)
    for chosen, colour in ((~foreground, _STATIC), (foreground, _MOVING)):
        column, row = np.floor(pixels(points[chosen].astype(np.float64))).astype(np.int64).T
        inside = (column >= 0) & (column < _SIDE) & (row >= _HEADER) & (row < _SIDE)
        raster[row[inside], column[inside]] = ImageColor.getrgb(colour)
    picture = Image.fromarray(raster)
    draw = ImageDraw.Draw(picture)
    for part in shapely.get_parts(region):
        for ring in (part.exterior, *part.interiors):
            draw.line([tuple(corner) for corner in pixels(shapely.get_coordinates(ring)).tolist()], _REGION, width=2)
    in_plan = boxes[:, [0, 1, 3, 4, 6]]
    for (x, y, length, _, yaw), corners, category in zip(
        in_plan.tolist(), box_corners(in_plan), categories, strict=True
    ):
        # The stroke from the middle through the front shows the heading.
        nose = np.array([(x, y), (x, y) + np.array([np.cos(yaw), np.sin(yaw)]) * (length / 2 + 0.8)])
        colour = BOX_COLOURS[category]
        draw.polygon([tuple(corner) for corner in pixels(corners).tolist()], outline=colour, width=2)
        draw.line([tuple(end) for end in pixels(nose).tolist()], fill=colour, width=2)
    for x, y in pixels(sensors).tolist():
        draw.ellipse((x - 6, y - 6, x + 6, y + 6), fill=SENSOR_BODY, outline=INK)
    _draw_header(draw, title, scale)
    return picture


def _draw_header(draw: ImageDraw.ImageDraw, title: str, scale: float) -> None:
    font = ImageFont.load_default(18)
    draw.text((10, 9), title, fill=INK, font=font)
    across = _SIDE - 10.0
    for category, colour in reversed(tuple(BOX_COLOURS.items())):
        across -= draw.textlength(category, font=font)
        draw.text((across, 9), category, fill=colour, font=font)
        across -= 16
    bar = 10 * scale
    draw.line((14, _SIDE - 14, 14 + bar, _SIDE - 14), fill=SOFT_INK, width=3)
    draw.text((14, _SIDE - 40), "10 m", fill=SOFT_INK, font=font)
    _draw_key(draw, font)


def _draw_key(draw: ImageDraw.ImageDraw, font: _Font) -> None:
    """Draw the key of points and of the outline in the lower right corner."""
    across = _SIDE - 10.0
    for words, colour in (("region", _REGION), ("background", _STATIC), ("foreground", _MOVING)):
        across -= draw.textlength(words, font=font)
        draw.text((across, _SIDE - 30), words, fill=SOFT_INK, font=font)
        across -= 18
        middle = _SIDE - 19
        if colour == _REGION:
            draw.line((across, middle, across + 12, middle), fill=colour, width=2)
        else:
            draw.ellipse((across + 2, middle - 4, across + 10, middle + 4), fill=colour)
        across -= 16
