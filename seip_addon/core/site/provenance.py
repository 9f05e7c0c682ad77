"""Provenance of a scene: where each kind of object comes from, and how many of their heights are assumed."""

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from .scene_geometry import ASSUMED

_NUMBER = re.compile(r"[ ._]*\d+( of the [a-z ]+)?$")
UNKNOWN = "by hand"
"""Source of what the scene does not say of where it comes from."""


@dataclass(frozen=True)
class ProvenanceRow:
    """Objects of one kind and source.

    Parameters
    ----------
    kind : str
        Such as ``Building``: their name without its number.
    source : str
        As in `scene_geometry.Pole`.
    count, assumed : int
        How many there are, and how many of these are assumed to be there, or to be as high as they are.
    """

    kind: str
    source: str
    count: int
    assumed: int


def provenance(objects: Iterable[tuple[str, str, bool]]) -> tuple[ProvenanceRow, ...]:
    """Count objects by kind and source.

    Parameters
    ----------
    objects : iterable of (name, source, height_assumed)
    """
    counts, assumed = Counter[tuple[str, str]](), Counter[tuple[str, str]]()
    for name, source, height_assumed in objects:
        key = (_NUMBER.sub("", name) or name, source or UNKNOWN)
        counts[key] += 1
        assumed[key] += height_assumed or source == ASSUMED
    return tuple(
        ProvenanceRow(kind, source, number, assumed[kind, source]) for (kind, source), number in counts.items()
    )


def provenance_lines(rows: Iterable[ProvenanceRow]) -> list[str]:
    """Return a table as lines of text, with a heading."""
    cells = [("part", "source", "count", "measured", "assumed")]
    cells += [
        (row.kind, row.source, f"{row.count:,}", f"{row.count - row.assumed:,}", f"{row.assumed:,}") for row in rows
    ]
    widths = [max(len(row[column]) for row in cells) for column in range(5)]
    return [
        "  ".join([*(row[i].ljust(widths[i]) for i in (0, 1)), *(row[i].rjust(widths[i]) for i in (2, 3, 4))]).rstrip()
        for row in cells
    ]
