"""Sources of a scene: counts of objects by kind and source, and of assumed sizes."""

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

_NUMBER = re.compile(r"[ ._]*\d+( of the [a-z ]+)?$")


_JOINERS = "\u200c\u200d"  # needed in Persian and Hindi, and for emoji


@dataclass(frozen=True)
class SourceCount:
    """Objects of one kind and source.

    Parameters
    ----------
    kind : str
        Name of the objects without their number, such as ``Building``.
    source : str
        Source, as in `scene_geometry.Pole`.
    count, assumed : int
        Number of objects, and number of these whose existence, height or width is assumed.
    """

    kind: str
    source: str
    count: int
    assumed: int


def one_line(text: str) -> str:
    """Return a text from a file without line breaks and without control characters."""
    if not text.isprintable():
        text = "".join(one if one.isprintable() or one in _JOINERS else " " for one in text)
    return " ".join(text.split())


def count_sources(objects: Iterable[tuple[str, str, bool]]) -> tuple[SourceCount, ...]:
    """Count objects by kind and source.

    Parameters
    ----------
    objects : iterable of (name, source, is assumed)
    """
    counts, assumed = Counter[tuple[str, str]](), Counter[tuple[str, str]]()
    for name, source, is_assumed in objects:
        key = (_NUMBER.sub("", name) or name, source)
        counts[key] += 1
        assumed[key] += is_assumed
    return tuple(SourceCount(*key, number, assumed[key]) for key, number in counts.items())


def source_table(rows: Iterable[SourceCount]) -> list[tuple[str, ...]]:
    """Return the rows of the table of sources, heading first."""
    heading = ("part", "source", "count", "measured", "assumed")
    cells = [
        (row.kind, row.source, f"{row.count:,}", f"{row.count - row.assumed:,}", f"{row.assumed:,}") for row in rows
    ]
    return [heading, *cells]


def source_lines(rows: Iterable[SourceCount]) -> list[str]:
    """Return the table of sources as lines of text."""
    cells = source_table(rows)
    widths = [max(len(row[column]) for row in cells) for column in range(5)]
    return [
        "  ".join([*(row[i].ljust(widths[i]) for i in (0, 1)), *(row[i].rjust(widths[i]) for i in (2, 3, 4))]).rstrip()
        for row in cells
    ]
