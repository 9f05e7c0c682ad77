"""Content of a report without its format: sections of paragraphs, lists, tables and pictures."""

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
    """Command line."""

    text: str


@dataclass(frozen=True)
class Table:
    """Table; the columns in ``numbers`` hold numbers and are aligned to the right.

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
        Time of the placement (ISO 8601); the time of the report is not recorded.
    """

    title: str
    summary: str
    created: str
    sections: tuple[Section, ...]
