"""Content of a report without its format: a first page, then sections of paragraphs, lists, tables and pictures."""

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
    """Table of few and narrow columns, which fit a phone; the columns in ``numbers`` hold numbers, on the right.

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
class Facts:
    """Names with their values, one below the other.

    Parameters
    ----------
    large : bool
        Whether these are the key figures of the report.
    """

    rows: tuple[tuple[str, str], ...]
    large: bool = False


@dataclass(frozen=True)
class Picture:
    """A picture as PNG.

    Parameters
    ----------
    tall : bool
        Whether it may fill a page.
    """

    png: bytes
    caption: str
    tall: bool = False


@dataclass(frozen=True)
class Pictures:
    """Pictures of one size side by side, or one below the other on a phone.

    Parameters
    ----------
    about : str
        What they show, for those who cannot see them.
    """

    pngs: tuple[bytes, ...]
    about: str


@dataclass(frozen=True)
class Card:
    """Something with a heading of its own that stays on one page, such as a sensor."""

    title: str
    blocks: tuple[Paragraph | Facts | Pictures, ...]


Block = Paragraph | Bullets | Code | Table | Facts | Picture | Pictures | Card


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
        Time of the placement (ISO 8601), "" if unknown; the time of the report is not recorded.
    first : tuple of Block
        Content of the first page.
    """

    title: str
    subtitle: str
    created: str
    first: tuple[Block, ...]
    sections: tuple[Section, ...]
