"""A report as PDF, A4, set with matplotlib alone; lengths are points."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator, Sequence
from datetime import datetime
from functools import lru_cache

import numpy as np
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.textpath import text_to_path
from PIL import Image

from ..pictures.palette import INK, PAPER, SOFT_INK
from ..pictures.plan_style import Style
from .blocks import Block, Bullets, Code, Paragraph, Picture, Report, Section, Table

WIDTH, HEIGHT = 595.0, 842.0
LEFT, RIGHT, TOP, BOTTOM = 50.0, 50.0, 52.0, 56.0
INNER = WIDTH - LEFT - RIGHT
BODY, SMALL, HEADING, TITLE = 9.5, 8.0, 13.0, 18.0
LEADING = 1.4  # of the size of the type
GAP = 7.0  # between blocks
COLUMN_GAP, ROW_GAP, LEAST_COLUMN = 9.0, 4.0, 26.0
MOST_PICTURE = 400.0  # height of a picture
UNBROKEN = 150.0  # height up to which a table stays on one page
KEPT_TOGETHER = 90.0  # room that must be left below a heading
RULE, SHADE = "#c9d1d7", "#eef1f3"
BULLET_INDENT = 12.0
CODE_PADDING = 6.0
TEXT: Style = {"family": "DejaVu Sans", "parse_math": False, "va": "baseline"}
MONO = "DejaVu Sans Mono"


def as_pdf(report: Report) -> bytes:
    """Return the report as PDF; its date of creation is that of the placement, so that the same gives the same bytes.

    Characters that the type does not have are shown as boxes.
    """
    content = io.BytesIO()
    created = datetime.fromisoformat(report.created)
    about = {"Title": report.title, "Creator": "SEIP for Blender", "CreationDate": created, "ModDate": created}
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        pages = _Typesetter().pages(report)
        with PdfPages(content, metadata=about) as file:
            for number, page in enumerate(pages, start=1):
                _footer(page, report.title, f"{number} / {len(pages)}")
                file.savefig(page)
    return content.getvalue()


class _Typesetter:
    """Pages in the making: the last one, and how far down it is filled."""

    def __init__(self) -> None:
        self._pages: list[Figure] = []
        self._y = 0.0  # of the next block's upper edge, from the foot of the page
        self._turn()

    def pages(self, report: Report) -> list[Figure]:
        """Set a report, and return its pages."""
        self._lines(report.title, TITLE, weight="bold")
        self._y -= 4.0
        self._lines(report.summary, HEADING - 1.0)
        self._lines(f"Placement of {report.created}", SMALL, color=SOFT_INK)
        for section in report.sections:
            self._section(section)
        return self._pages

    def _section(self, section: Section) -> None:
        self._y -= 2 * GAP
        self._need(KEPT_TOGETHER)
        self._rule(self._y + GAP, RULE)
        self._lines(section.title, HEADING, weight="bold")
        for block in section.blocks:
            self._y -= GAP
            self._block(block)

    def _block(self, block: Block) -> None:
        if isinstance(block, Paragraph):
            self._lines(block.text, BODY)
        elif isinstance(block, Bullets):
            for line in block.lines:
                self._need(BODY * LEADING)
                self._text(LEFT + 2.0, self._y - BODY, "•", BODY)
                self._lines(line, BODY, indent=BULLET_INDENT)
                self._y -= 1.5
        elif isinstance(block, Code):
            self._code(block.text)
        elif isinstance(block, Picture):
            self._picture(block)
        else:
            self._table(block)

    def _lines(self, text: str, size: float, *, indent: float = 0.0, weight: str = "normal", color: str = INK) -> None:
        for line in _wrapped(text, INNER - indent, size, weight):
            self._need(size * LEADING)
            self._text(LEFT + indent, self._y - size, line, size, weight=weight, color=color)
            self._y -= size * LEADING

    def _code(self, text: str) -> None:
        lines = list(_wrapped(text, INNER - 2 * CODE_PADDING, SMALL, "normal", MONO))
        high = len(lines) * SMALL * LEADING + 2 * CODE_PADDING
        self._need(high)
        box = Rectangle((LEFT / WIDTH, (self._y - high) / HEIGHT), INNER / WIDTH, high / HEIGHT, facecolor=SHADE)
        self._page.add_artist(box)
        for number, line in enumerate(lines):
            low = self._y - CODE_PADDING - SMALL - number * SMALL * LEADING
            self._text(LEFT + CODE_PADDING, low, line, SMALL, family=MONO)
        self._y -= high

    def _picture(self, picture: Picture) -> None:
        pixels = np.asarray(Image.open(io.BytesIO(picture.png)).convert("RGB"))
        wide = min(INNER, MOST_PICTURE * pixels.shape[1] / pixels.shape[0])
        high = wide * pixels.shape[0] / pixels.shape[1]
        self._need(high + 3 * SMALL * LEADING)
        place = (LEFT / WIDTH, (self._y - high) / HEIGHT, wide / WIDTH, high / HEIGHT)
        axes = self._page.add_axes(place)
        axes.imshow(pixels, interpolation="none", aspect="auto")
        axes.set(xticks=(), yticks=())
        axes.spines[:].set(color=RULE, linewidth=0.6)
        self._y -= high + 4.0
        self._lines(picture.caption, SMALL, color=SOFT_INK)

    def _table(self, table: Table) -> None:
        widths = _column_widths(table)
        head = [list(_wrapped(cell, width, SMALL, "bold")) for cell, width in zip(table.head, widths, strict=True)]
        rows = [
            [list(_wrapped(cell, width, SMALL, "normal")) for cell, width in zip(row, widths, strict=True)]
            for row in table.rows
        ]
        high = _row_height(head) + sum(map(_row_height, rows))
        self._need(high if high <= UNBROKEN else _row_height(head) + _row_height(rows[0]))
        self._row(table, head, widths, weight="bold")
        for row in rows:
            if self._y - _row_height(row) < BOTTOM:
                self._turn()
                self._row(table, head, widths, weight="bold")
            self._row(table, row, widths)

    def _row(self, table: Table, cells: list[list[str]], widths: list[float], *, weight: str = "normal") -> None:
        left = LEFT
        for column, (lines, width) in enumerate(zip(cells, widths, strict=True)):
            right = column in table.numbers
            for number, line in enumerate(lines):
                low = self._y - SMALL - number * SMALL * LEADING
                x = left + width if right else left
                self._text(x, low, line, SMALL, weight=weight, ha="right" if right else "left")
            left += width + COLUMN_GAP
        self._y -= _row_height(cells)
        self._rule(self._y + ROW_GAP / 2, INK if weight == "bold" else RULE, left - COLUMN_GAP)

    def _text(  # noqa: PLR0913  # where, what and how
        self,
        x: float,
        y: float,
        text: str,
        size: float,
        *,
        weight: str = "normal",
        color: str = INK,
        ha: str = "left",
        family: str = "DejaVu Sans",
    ) -> None:
        style = TEXT | {"family": family, "size": size, "weight": weight, "color": color, "ha": ha}
        self._page.text(x / WIDTH, y / HEIGHT, text, **style)

    def _rule(self, y: float, color: str, right: float = WIDTH - RIGHT) -> None:
        self._page.add_artist(
            Line2D((LEFT / WIDTH, right / WIDTH), (y / HEIGHT, y / HEIGHT), color=color, linewidth=0.6)
        )

    def _need(self, room: float) -> None:
        """Turn the page where less room is left."""
        if self._y - room < BOTTOM and self._y < HEIGHT - TOP:
            self._turn()

    def _turn(self) -> None:
        self._page = Figure((WIDTH / 72, HEIGHT / 72), facecolor=PAPER)
        self._pages.append(self._page)
        self._y = HEIGHT - TOP


def _footer(page: Figure, title: str, number: str) -> None:
    style = TEXT | {"size": SMALL, "color": SOFT_INK}
    (short, *more) = list(_wrapped(title, INNER - 60.0, SMALL, "normal")) or [""]
    page.text(LEFT / WIDTH, (BOTTOM - 22.0) / HEIGHT, f"{short} …" if more else short, ha="left", **style)
    page.text((WIDTH - RIGHT) / WIDTH, (BOTTOM - 22.0) / HEIGHT, number, ha="right", **style)


def _row_height(cells: Sequence[Sequence[str]]) -> float:
    return max(len(lines) for lines in cells) * SMALL * LEADING + ROW_GAP


def _column_widths(table: Table) -> list[float]:
    """Return widths in which all columns fit on the page: the widest give way."""
    columns = list(zip(table.head, *table.rows, strict=True))
    weights = ["bold"] + ["normal"] * len(table.rows)
    widths = [max(_width(cell, SMALL, w) for cell, w in zip(column, weights, strict=True)) for column in columns]
    widths = [
        max(width + 0.5, LEAST_COLUMN if any(column) else 0.0) for width, column in zip(widths, columns, strict=True)
    ]
    room = INNER - COLUMN_GAP * (len(widths) - 1)
    while sum(widths) > room:
        widest = max(range(len(widths)), key=widths.__getitem__)
        others = sorted(widths)[-2] if len(widths) > 1 else 0.0
        over = sum(widths) - room
        step = widths[widest] - others
        widths[widest] -= min(over, step) if step > 1.0 else min(over, 1.0)
    return widths


def _wrapped(text: str, room: float, size: float, weight: str, family: str = "DejaVu Sans") -> Iterator[str]:
    """Yield the lines of a text, broken at blanks, and within words that are longer than a line."""
    line = ""
    for word in text.split():
        rest = word
        while True:
            tried = f"{line} {rest}" if line else rest
            if _width(tried, size, weight, family) <= room:
                line = tried
                break
            if line:
                yield line
                line = ""
                continue
            fits = max(1, sum(_width(rest[:end], size, weight, family) <= room for end in range(1, len(rest))))
            if len(rest) == 1:
                line = rest
                break
            yield rest[:fits]
            rest = rest[fits:]
    if line:
        yield line


@lru_cache(maxsize=65536)
def _width(text: str, size: float, weight: str, family: str = "DejaVu Sans") -> float:
    properties = FontProperties(family=family, size=size, weight=weight)
    width, _, _ = text_to_path.get_text_width_height_descent(text, properties, ismath=False)
    return float(width)
