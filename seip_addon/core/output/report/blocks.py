"""Content of a report without its format: a first page, then sections of paragraphs, lists, tables and pictures.

Its page of HTML has no script, and loads nothing.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path

POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""Nothing is fetched, and no script runs, whatever stands in the page."""

_DIRECTIONS = re.compile("[\u202a-\u202e\u2066-\u2069]")

STYLE = Path(__file__).with_name("report.css")


@dataclass(frozen=True)
class Paragraph:
    """A paragraph of plain text."""

    text: str


@dataclass(frozen=True)
class Bullets:
    """A list of sentences."""

    lines: tuple[str, ...]


@dataclass(frozen=True)
class Table:
    """Table of few and narrow columns, which fit a phone; the columns in ``numbers``, from 0, are aligned right."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Facts:
    """Names with their values, one below the other; large if these are the key figures of the report."""

    rows: tuple[tuple[str, str], ...]
    large: bool = False


@dataclass(frozen=True)
class Picture:
    """A picture as PNG; a tall one may fill a page."""

    png: bytes
    caption: str
    tall: bool = False


@dataclass(frozen=True)
class Card:
    """Something with a heading of its own that stays on one page, such as a sensor."""

    title: str
    blocks: tuple[Paragraph | Facts, ...]


Block = Paragraph | Bullets | Table | Facts | Picture | Card


@dataclass(frozen=True)
class Report:
    """A report with the content of its first page.

    ``created`` is the time of the placement (ISO 8601); the time of the report is not recorded. ``sections`` are
    blocks by the title of their section.
    """

    title: str
    subtitle: str
    created: str
    first: tuple[Block, ...]
    sections: Mapping[str, tuple[Block, ...]]


def make_sections(contents: Mapping[str, Iterable[Block]]) -> dict[str, tuple[Block, ...]]:
    """Return blocks by the title of their section, without empty sections."""
    sections = {title: tuple(blocks) for title, blocks in contents.items()}
    return {title: blocks for title, blocks in sections.items() if blocks}


def as_html(report: Report) -> str:
    """Return the page, which loads nothing."""
    sections = "\n".join(
        f"<section>\n<h2>{_shown(title)}</h2>\n{_blocks(blocks)}\n</section>"
        for title, blocks in report.sections.items()
    )
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{escape(POLICY)}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{_shown(report.title)}</title>
<style>
{STYLE.read_text(encoding="utf-8")}</style>
</head>
<body>
<header>
<h1>{_shown(report.title)}</h1>
<p class="subtitle">{_shown(report.subtitle)}</p>
{_blocks(report.first)}
</header>
{sections}
</body>
</html>
"""


def _shown(text: str) -> str:
    """Return a text for a page, without marks by which a name would reverse the order of what follows it."""
    return escape(_DIRECTIONS.sub("", text))


def _blocks(blocks: Iterable[Block]) -> str:
    return "\n".join(map(_block, blocks))


def _block(block: Block) -> str:
    if isinstance(block, Paragraph):
        html = f"<p>{_shown(block.text)}</p>"
    elif isinstance(block, Bullets):
        html = "<ul>\n" + "\n".join(f"<li>{_shown(line)}</li>" for line in block.lines) + "\n</ul>"
    elif isinstance(block, Facts):
        rows = "\n".join(f"<dt>{_shown(name)}</dt><dd>{_shown(value)}</dd>" for name, value in block.rows)
        kind = ' class="large"' if block.large else ""
        html = f"<dl{kind}>\n{rows}\n</dl>"
    elif isinstance(block, Card):
        html = f'<div class="card">\n<h3>{_shown(block.title)}</h3>\n{_blocks(block.blocks)}\n</div>'
    elif isinstance(block, Picture):
        caption = f"<figcaption>{_shown(block.caption)}</figcaption>"
        html = f"<figure>{_image(block.png, block.caption)}{caption}</figure>"
    else:
        inner = "\n".join(_row(block, row, "td") for row in block.rows)
        head = _row(block, block.head, "th")
        html = f"<table>\n<thead>\n{head}\n</thead>\n<tbody>\n{inner}\n</tbody>\n</table>"
    return html


def _image(png: bytes, caption: str) -> str:
    source = f"data:image/png;base64,{base64.b64encode(png).decode('ascii')}"
    return f'<img src="{source}" alt="{_shown(caption)}">'


def _row(table: Table, cells: tuple[str, ...], tag: str) -> str:
    kinds = (' class="number"' if column in table.numbers else "" for column in range(len(cells)))
    inner = "".join(f"<{tag}{kind}>{_shown(cell)}</{tag}>" for kind, cell in zip(kinds, cells, strict=True))
    return f"<tr>{inner}</tr>"
