"""What a report is made of: sections of paragraphs, lists, tables and pictures, before anything says how they look."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Paragraph:
    """A paragraph of plain text."""

    text: str


@dataclass(frozen=True)
class Bullets:
    """A list of sentences."""

    lines: tuple[str, ...]


@dataclass(frozen=True)
class Code:
    """A command to be typed."""

    text: str


@dataclass(frozen=True)
class Table:
    """A table; columns that are named in ``numbers`` hold numbers, and stand to the right.

    Parameters
    ----------
    head : tuple of str
    rows : tuple of tuple of str
        Each as long as the head.
    numbers : frozenset of int
        Columns, from 0.
    """

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Picture:
    """A picture as PNG."""

    png: bytes
    caption: str


Block = Paragraph | Bullets | Code | Table | Picture


@dataclass(frozen=True)
class Section:
    """A section with its heading."""

    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Report:
    """A report.

    Parameters
    ----------
    created : str
        When the placement was made (ISO 8601); no report says when it was written.
    """

    title: str
    summary: str
    created: str
    sections: tuple[Section, ...]
