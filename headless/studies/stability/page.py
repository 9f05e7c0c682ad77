"""The stability page: limits of each method, chapter by chapter, as Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from pathlib import Path

from headless.studies.markdown import table

from seip_addon.core.storage.files import whole_file

HEADINGS = ("Method", "Driven by", "Begins to fail", "How found", "What the tool does")
"""Headings of the columns, in the order of the fields of a row."""


@dataclass(frozen=True)
class Row:
    """One regime in which a method begins to fail.

    Parameters
    ----------
    method : str
        Method and its subject.
    regime : str
        Quantity that was increased until the method failed.
    begins : str
        Value at which it begins to fail, with unit and interval.
    how : str
        Method by which that was found.
    answer : str
        Response of the program.
    """

    method: str
    regime: str
    begins: str
    how: str
    answer: str


@dataclass(frozen=True)
class Chapter:
    """A chapter of the page: rows and charts of one study.

    Parameters
    ----------
    charts : mapping of str to str
        Caption of each chart, by its file in the folder of charts.
    """

    title: str
    rows: Sequence[Row]
    charts: dict[str, str]


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
        parts += [f"## {chapter.title}", table(HEADINGS, list(map(astuple, chapter.rows)))]
        parts += [f"![{caption}]({charts}/{file})\n\n{caption}" for file, caption in chapter.charts.items()]
    with whole_file(path) as temporary:
        temporary.write_text("\n\n".join(parts) + "\n", encoding="utf-8")
