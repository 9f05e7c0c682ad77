"""Report as PDF: A4, set by fpdf2. Lengths are points."""

from __future__ import annotations

import io
import logging
from collections.abc import Callable, Sequence
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import cast

import matplotlib as mpl
from fpdf import FPDF, FontFace
from fpdf.enums import Align, TableBordersLayout, VAlign, XPos, YPos
from PIL import Image

from ...storage.files import whole_file
from ..pictures.palette import INK, SOFT_INK
from ..results.file_names import REPORT_FILES
from .blocks import Block, Bullets, Card, Facts, Paragraph, Picture, Report, Table, as_html

MARGIN, TOP, BOTTOM = 50.0, 52.0, 56.0
BODY, SMALL, CARD_TITLE, LARGE, HEADING, TITLE = 9.5, 8.0, 10.5, 10.5, 14.0, 20.0
LEADING = 1.4  # height of a line, in sizes of the type
GAP = 7.0  # between blocks
FIRST_PICTURE_HEIGHTS = (400.0, 350.0, 300.0, 250.0, 200.0)
"""Heights of the picture on the first page: the largest with which all of it is on one page."""
MAX_PICTURE_HEIGHT, FULL_PAGE_HEIGHT = 400.0, 620.0
LEAST_SHARE = 0.65
"""Share of its size to which a picture is reduced to fit on a page; if that is not enough, what follows comes first."""
HEADING_ROOM, TABLE_ROOM = 90.0, 50.0  # below the top of a heading, and of a table, so that they do not end a page
MOST_TOGETHER = 12  # rows of a table that stay on one page
RULE = "#c9d1d7"
BULLET_INDENT, CELL_PADDING = 12.0, 3.0
TEXT = "text"
FONTS = {"": "DejaVuSans", "B": "DejaVuSans-Bold"}
"""Files of the type, which Matplotlib brings, by style."""


def save_report(folder: Path, report: Report) -> tuple[Path, ...]:
    """Write ``report.html`` and ``report.pdf``, and return their paths."""
    for name, content in zip(REPORT_FILES, (as_html(report).encode(), as_pdf(report)), strict=True):
        with whole_file(folder / name) as temporary:
            temporary.write_bytes(content)
    return tuple(folder / name for name in REPORT_FILES)


def as_pdf(report: Report) -> bytes:
    """Return the report as a PDF file.

    Its date is that of the placement, so that the same report gives the same bytes. Characters that the type lacks are
    shown as boxes.
    """
    logging.getLogger("fpdf").setLevel(logging.ERROR)  # it warns of each character that the type lacks
    pdf = _Document(report.title)
    pdf.set_creation_date(datetime.fromisoformat(report.created))
    pdf.add_page()
    for highest in FIRST_PICTURE_HEIGHTS:
        add = partial(_add_first, report=report, highest=highest)
        if pdf.has_room(add):
            break
    add(pdf)
    if report.sections:
        pdf.add_page()
    for title, blocks in report.sections.items():
        _add_section(pdf, title, blocks)
    return bytes(pdf.output())


class _Document(FPDF):
    """A4 pages with the title and the page number at the foot."""

    def __init__(self, title: str) -> None:
        super().__init__(unit="pt", format="A4")
        self._footer_title = title
        folder = Path(mpl.get_data_path()) / "fonts" / "ttf"
        for style, file in FONTS.items():
            self.add_font(TEXT, style, folder / f"{file}.ttf")
        self.set_title(title)
        self.set_creator("SEIP for Blender")
        self.set_margins(MARGIN, TOP, MARGIN)
        self.set_auto_page_break(auto=True, margin=BOTTOM)
        self.c_margin = 0.0

    def footer(self) -> None:
        """Write the foot of a page; called by fpdf2."""
        self.set_y(-BOTTOM + 14.0)
        self.set_font(TEXT, "", SMALL)
        self.set_text_color(SOFT_INK)
        room = self.epw - 60.0
        title = self._footer_title
        while title and self.get_string_width(f"{title} …") > room:
            title = title[:-1]
        self.cell(room, SMALL, title if title == self._footer_title else f"{title} …")
        self.cell(60.0, SMALL, f"{self.page_no()} / {{nb}}", align="R")

    def text_lines(self, text: str, size: float, *, style: str = "", color: str = INK, indent: float = 0.0) -> None:
        """Write text in the width of the page, or from an indent on, and go to the next line."""
        self.set_font(TEXT, style, size)
        self.set_text_color(color)
        self.set_x(MARGIN + indent)
        self.multi_cell(0, size * LEADING, text, align="L", new_x=XPos.LMARGIN, new_y=YPos.NEXT)

    def rule(self, room: float = 4.0) -> None:
        """Draw a line across the page, and leave some room below."""
        self.set_draw_color(RULE)
        self.set_line_width(0.6)
        self.line(MARGIN, self.y, self.w - MARGIN, self.y)
        self.ln(room)

    def need(self, room: float) -> None:
        """Start a new page if less room than given is left on this one."""
        if self.will_page_break(room):
            self.add_page()

    def has_room(self, add: Callable[[_Document], None]) -> bool:
        """Return whether what a function adds fits on the page."""
        with self.offset_rendering() as trial:
            add(cast("_Document", trial))  # records the same calls
        return not trial.page_break_triggered

    def add_whole(self, add: Callable[[_Document], None]) -> None:
        """Add something on one page if it fits on one."""
        if not self.has_room(add):
            self.add_page()
        add(self)


def _add_first(pdf: _Document, report: Report, highest: float) -> None:
    pdf.text_lines(report.title, TITLE, style="B")
    pdf.text_lines(report.subtitle, HEADING - 2.0, color=SOFT_INK)
    for block in report.first:
        pdf.ln(GAP)
        _add_block(pdf, block, highest, whole=False)


def _add_heading(pdf: _Document, title: str) -> None:
    if pdf.y > TOP:
        pdf.set_y(pdf.y + GAP)
        pdf.rule(GAP)
    pdf.text_lines(title, HEADING, style="B")


def _add_opening(pdf: _Document, title: str, first: Block) -> None:
    """Add the heading of a section and its first block, to see whether they fit on a page together."""
    _add_heading(pdf, title)
    pdf.ln(GAP)
    _add_block(pdf, first, whole=False)


def _stays_whole(block: Block) -> bool:
    return isinstance(block, Facts | Card) or (isinstance(block, Table) and len(block.rows) <= MOST_TOGETHER)


def _add_section(pdf: _Document, title: str, blocks: Sequence[Block]) -> None:
    opening = partial(_add_opening, title=title, first=blocks[0])
    together = _stays_whole(blocks[0]) or all(isinstance(block, Picture) for block in blocks)
    room = pdf.has_room(opening) if together else not pdf.will_page_break(HEADING_ROOM)
    if not room and pdf.y > TOP:
        pdf.add_page()
    _add_heading(pdf, title)
    waiting: list[Picture] = []  # that the rest of the page has no room for
    for block in blocks:
        if isinstance(block, Picture):
            waiting.append(block)
        else:
            _add_below(pdf, block)
        while waiting and pdf.has_room(partial(_add_below, block=waiting[0])):
            _add_below(pdf, waiting.pop(0))
    for picture in waiting:
        _add_below(pdf, picture)


def _add_below(pdf: _Document, block: Block) -> None:
    pdf.ln(GAP)
    _add_block(pdf, block)


def _add_block(pdf: _Document, block: Block, highest: float = MAX_PICTURE_HEIGHT, *, whole: bool = True) -> None:
    """Add a block; pictures up to a height, and facts and the like on one page if they are to stay whole."""
    if whole and _stays_whole(block):
        pdf.add_whole(partial(_add_block, block=block, whole=False))
    elif isinstance(block, Paragraph):
        pdf.text_lines(block.text, BODY)
    elif isinstance(block, Bullets):
        _add_bullets(pdf, block.lines)
    elif isinstance(block, Facts):
        _add_facts(pdf, block)
    elif isinstance(block, Card):
        pdf.ln(GAP / 2)
        pdf.rule()
        pdf.text_lines(block.title, CARD_TITLE, style="B")
        for inner in block.blocks:
            pdf.ln(4.0)
            _add_block(pdf, inner, whole=False)
    elif isinstance(block, Picture):
        _add_picture(pdf, block, FULL_PAGE_HEIGHT if block.tall else highest)
    else:
        _add_table(pdf, block)


def _add_bullets(pdf: _Document, lines: Sequence[str]) -> None:
    for line in lines:
        pdf.need(BODY * LEADING)
        top = pdf.y
        pdf.text_lines("•", BODY, indent=2.0)
        pdf.set_y(top)
        pdf.text_lines(line, BODY, indent=BULLET_INDENT)


def _add_picture(pdf: _Document, picture: Picture, highest: float) -> None:
    """Add a picture with its caption, reduced if it then fits on the page."""
    image = Image.open(io.BytesIO(picture.png)).convert("RGB")
    below = 3 * SMALL * LEADING
    height = min(highest, pdf.epw * image.height / image.width)
    left_over = pdf.page_break_trigger - pdf.y - below - 1.0
    if LEAST_SHARE * height <= left_over:
        height = min(height, left_over)
    width = height * image.width / image.height
    pdf.need(height + below)
    top = pdf.y
    pdf.set_draw_color(RULE)
    pdf.image(image, x=MARGIN, y=top, w=width, h=height)
    pdf.rect(MARGIN, top, width, height)
    pdf.set_y(top + height + 4.0)
    pdf.text_lines(picture.caption, SMALL, color=SOFT_INK)


def _add_facts(pdf: _Document, facts: Facts) -> None:
    """Add names and values in two columns; those of the first page in larger type between two lines."""
    size = LARGE if facts.large else BODY
    pdf.set_font(TEXT, "", size)
    indent = max(pdf.get_string_width(name) for name, _ in facts.rows) + 2 * GAP
    if facts.large:
        pdf.rule()
    for name, value in facts.rows:
        pdf.need(size * LEADING)
        top = pdf.y
        pdf.text_lines(name, size, color=SOFT_INK)
        below = pdf.y
        pdf.set_y(top)
        pdf.text_lines(value, size, style="B" if facts.large else "", indent=indent)
        pdf.set_y(max(below, pdf.y) + 1.5)
    if facts.large:
        pdf.rule()


def _add_table(pdf: _Document, table: Table) -> None:
    pdf.need(TABLE_ROOM)
    pdf.set_font(TEXT, "", SMALL)
    pdf.set_text_color(INK)
    pdf.set_draw_color(RULE)
    widths = _column_widths(pdf, table)
    with pdf.table(
        rows=[table.head, *table.rows],
        width=min(pdf.epw, sum(widths)),
        align=Align.L,
        col_widths=widths,
        text_align=tuple(Align.R if column in table.numbers else Align.L for column in range(len(table.head))),
        borders_layout=TableBordersLayout.HORIZONTAL_LINES,
        headings_style=FontFace(emphasis="BOLD"),
        line_height=SMALL * LEADING,
        padding=(1.0, CELL_PADDING),
        v_align=VAlign.T,
    ):
        pass


def _column_widths(pdf: FPDF, table: Table) -> list[float]:
    """Return the width that the longest cell of each column needs; the widest are cut so that all fit on the page."""
    widths = []
    for column in zip(table.head, *table.rows, strict=True):
        pdf.set_font(TEXT, "B", SMALL)
        heading = pdf.get_string_width(column[0])
        pdf.set_font(TEXT, "", SMALL)
        longest = max([heading, *(pdf.get_string_width(cell) for cell in column[1:])])
        widths.append(max(longest, SMALL) + 2 * CELL_PADDING + 1.0)
    room = pdf.epw
    for columns, width in zip(range(len(widths), 0, -1), sorted(widths), strict=True):
        if width > room / columns:  # this column and all wider ones share the room that the narrower ones leave
            return [min(own, room / columns) for own in widths]
        room -= width
    return widths
