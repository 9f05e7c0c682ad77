"""Reports in the folder of a result."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path

from ...progress import Progress
from ...storage.files import whole_file
from ..results.file_names import REPORT_FILES
from .evidence import load_evidence
from .html import as_html
from .pdf import as_pdf
from .sections import make_report


def write_report(folder: Path) -> Generator[Progress, None, tuple[Path, ...]]:
    """Write ``report.html`` and ``report.pdf`` into the folder of a result; the same folder gives the same bytes.

    Returns
    -------
    tuple of path

    Raises
    ------
    SeipError
        The folder holds no result, or a damaged one, or cannot be written.
    """
    yield Progress(0, 0, "reading the result")
    evidence = load_evidence(folder)
    yield Progress(0, 0, "setting the report")
    report = make_report(evidence)
    contents = (as_html(report).encode("utf-8"), as_pdf(report))
    for name, content in zip(REPORT_FILES, contents, strict=True):
        with whole_file(folder / name) as temporary:
            temporary.write_bytes(content)
    return tuple(folder / name for name in REPORT_FILES)
