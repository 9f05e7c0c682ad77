"""Sheet of close-ups: a row for each sensor, with its plan and, where the scene was rendered, its view."""

from __future__ import annotations

import io
from collections.abc import Sequence

from PIL import Image

from .palette import PAPER

TILE = (640, 480)
"""Width and height of a close-up, pixels."""
MOST = 60
"""Largest number of sensors on a sheet: readers refuse larger pictures."""


def close_up_sheet(rows: Sequence[Sequence[Image.Image]]) -> Image.Image:
    """Return a sheet of close-ups, each of the size `TILE`, the same number in each row."""
    sheet = Image.new("RGB", (len(rows[0]) * TILE[0], len(rows) * TILE[1]), PAPER)
    for number, row in enumerate(rows):
        for column, picture in enumerate(row):
            sheet.paste(picture, (column * TILE[0], number * TILE[1]))
    return sheet.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)


def close_ups(sheet: bytes, count: int) -> list[tuple[bytes, ...]]:
    """Return the pictures of each sensor on a sheet, as PNG: its plan, and its view if the sheet has views.

    Raises
    ------
    ValueError
        The sheet is not one of ``count`` sensors.
    """
    with Image.open(io.BytesIO(sheet), formats=("PNG",)) as picture:
        across, rows = picture.width // TILE[0], min(count, MOST)
        if picture.size != (across * TILE[0], rows * TILE[1]) or across not in {1, 2}:
            raise ValueError(f"a sheet of {picture.width} by {picture.height} pixels, not of {count} sensors")
        return [tuple(_tile(picture, column, row) for column in range(across)) for row in range(rows)]


def _tile(sheet: Image.Image, column: int, row: int) -> bytes:
    left, top = column * TILE[0], row * TILE[1]
    content = io.BytesIO()
    sheet.crop((left, top, left + TILE[0], top + TILE[1])).save(content, format="PNG")
    return content.getvalue()
