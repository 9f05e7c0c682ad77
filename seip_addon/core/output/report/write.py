"""Reports in the folder of a result."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path

from ...errors import SeipError
from ...limits import EFFORT as EFFORT_LIMITS
from ...progress import Progress
from ...storage.files import whole_file
from ..results.file_names import REPORT_FILES
from .evidence import load_evidence
from .html import as_html
from .losses import front
from .pdf import as_pdf
from .sections import make_report

EFFORT = 5.0
"""Counted work for each other number of sensors; a unit is about a second of one core."""


def write_report(folder: Path, effort: float = EFFORT) -> Generator[Progress, None, tuple[Path, ...]]:
    """Write ``report.html`` and ``report.pdf`` into the folder of a result; the same folder gives the same bytes.

    Parameters
    ----------
    effort : float, units of counted work
        Spent on the best choice of each other number of sensors; at 0 the report goes without these.

    Returns
    -------
    tuple of path

    Raises
    ------
    SeipError
        The folder holds no result, or a damaged one, or cannot be written.
    """
    if not EFFORT_LIMITS.allow(effort):
        raise SeipError(f"the effort must be {EFFORT_LIMITS} units of counted work, not {effort:g}")
    yield Progress(0, 0, "reading the result")
    evidence = load_evidence(folder)
    points = yield from front(evidence, effort)
    yield Progress(0, 0, "setting the report")
    report = make_report(evidence, points)
    contents = (as_html(report).encode("utf-8"), as_pdf(report))
    for name, content in zip(REPORT_FILES, contents, strict=True):
        with whole_file(folder / name) as temporary:
            temporary.write_bytes(content)
    return tuple(folder / name for name in REPORT_FILES)
