"""CSV tables for spreadsheets, in which names from maps and scenes are never taken for formulas."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable, Sequence

from ..base.counts import is_number
from .files import whole_file

_FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\n", "\N{FULLWIDTH EQUALS SIGN}", "\N{FULLWIDTH PLUS SIGN}")
"""First characters of cells that spreadsheets take for formulas (OWASP, "CSV Injection")."""


def save_csv(path: str | os.PathLike[str], columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a table as CSV in UTF-8, one line for each row.

    Texts that a spreadsheet would take for formulas are prefixed by an apostrophe, which spreadsheets do not show.

    Raises
    ------
    SeipError
        The file cannot be written.
    """
    with whole_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([_cell(value) for value in row] for row in rows)


def _cell(value: object) -> object:
    if not isinstance(value, str):
        return value
    value = value.replace("\r", " ")  # the csv module leaves it unquoted, and readers take it for a new row
    if not value.lstrip(" ").startswith(_FORMULA_STARTS):
        return value
    return value if all(map(is_number, value.split())) else f"'{value}"
