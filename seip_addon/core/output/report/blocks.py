"""Content of a report without its format: a first page, then sections of paragraphs, lists, tables and pictures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
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
class Section:
    """A section with its heading."""

    title: str
    blocks: tuple[Block, ...]


def make_sections(contents: Mapping[str, Iterable[Block]]) -> tuple[Section, ...]:
    """Return sections by their titles, without empty ones."""
    sections = (Section(title, tuple(blocks)) for title, blocks in contents.items())
    return tuple(section for section in sections if section.blocks)


@dataclass(frozen=True)
class Report:
    """A report with the content of its first page.

    ``created`` is the time of the placement (ISO 8601); the time of the report is not recorded.
    """

    title: str
    subtitle: str
    created: str
    first: tuple[Block, ...]
    sections: tuple[Section, ...]
