"""The stability page: limits of each method, chapter by chapter, as Markdown; chapters as JSON."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from seip_addon.core.errors import SeipError
from seip_addon.core.storage.files import save_json, whole_file

from .rows import Row

SCHEMA, VERSION = "seip.stability", 1

HEADINGS = ("Method", "Driven by", "Begins to fail", "How found", "What the tool does")
"""Headings of the columns, in the order of the fields of a row."""


@dataclass(frozen=True)
class Chart:
    """A picture with its caption.

    Parameters
    ----------
    file : str
        Name of the file in the folder of charts.
    """

    file: str
    caption: str


@dataclass(frozen=True)
class Chapter:
    """A chapter of the page: rows and charts of one study."""

    title: str
    rows: tuple[Row, ...]
    charts: tuple[Chart, ...]


def save_chapter(path: Path, chapter: Chapter, key: str) -> None:
    """Write a chapter as JSON, with a key (digest of all its inputs)."""
    save_json(path, {"schema": SCHEMA, "version": VERSION, "key": key, **asdict(chapter)})


def load_chapter(path: Path, key: str) -> Chapter | None:
    """Read a chapter; None if there is none, or if its inputs had a different key."""
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
        if (kept["schema"], kept["version"], kept["key"]) != (SCHEMA, VERSION, key):
            return None
        rows = tuple(Row(**row) for row in kept["rows"])
        return Chapter(kept["title"], rows, tuple(Chart(**chart) for chart in kept["charts"]))
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return None


def save_page(path: Path, lead: str, chapters: Sequence[Chapter], charts: str) -> None:
    """Write the page.

    Parameters
    ----------
    lead : str
        Text before the first chapter.
    charts : str
        Folder of the charts, seen from the page.
    """
    parts = ["# Stability", lead]
    for chapter in chapters:
        parts += _chapter_parts(chapter, charts)
    _write(path, parts)


def put_chapter(path: Path, chapter: Chapter, charts: str) -> None:
    """Put a chapter into an existing page: in place of the chapter of the same title, or at the end.

    Parameters
    ----------
    charts : str
        Folder of the charts, seen from the page.

    Raises
    ------
    SeipError
        The page cannot be read.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise SeipError(f"there is no page {path} to put a chapter into: study all chapters first") from error
    lead, *others = (part.strip() for part in re.split(r"^(?=## )", text, flags=re.MULTILINE))
    heading, *rest = _chapter_parts(chapter, charts)
    new = "\n\n".join((heading, *rest))
    titles = [other.partition("\n")[0] for other in others]
    if heading in titles:
        others[titles.index(heading)] = new
    else:
        others.append(new)
    _write(path, [lead, *others])


def _chapter_parts(chapter: Chapter, charts: str) -> list[str]:
    pictures = [f"![{chart.caption}]({charts}/{chart.file})\n\n{chart.caption}" for chart in chapter.charts]
    return [f"## {chapter.title}", _table(chapter.rows), *pictures]


def _write(path: Path, parts: Sequence[str]) -> None:
    with whole_file(path) as temporary:
        temporary.write_text("\n\n".join(parts) + "\n", encoding="utf-8")


def _table(rows: Sequence[Row]) -> str:
    lines = [HEADINGS, ("---",) * len(HEADINGS)]
    lines += [tuple(getattr(row, field.name) for field in fields(Row)) for row in rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |" for line in lines)
