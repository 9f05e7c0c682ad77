"""``placement.json`` as a file, and as the text that a scene keeps.

`tests/core/output/results/test_placement_record.py` shows its use.
"""

import os
from functools import lru_cache
from pathlib import Path
from typing import Any

from ...errors import SeipError
from ...storage.files import save_json
from ...storage.json_dataclass import read_record
from .placement_record import SCHEMA, PlacementRecord


def save_placement(path: str | os.PathLike[str], record: PlacementRecord) -> None:
    """Write ``placement.json``."""
    save_json(path, record.as_json())


def load_placement(path: str | os.PathLike[str]) -> PlacementRecord:
    """Read ``placement.json``.

    Raises
    ------
    SeipError
        There is no such file, or it is not a placement of a version that this program can read.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise SeipError(f"cannot read {path}: {error.strerror}; name the placement.json of a finished run") from error
    return _read(content, str(path))


@lru_cache(maxsize=8)
def parsed_record(text: str) -> PlacementRecord:
    """Read the record that a scene keeps as `PlacementRecord.text`; panels do so at every redraw.

    Raises
    ------
    SeipError
        It is not a placement of a version that this program can read.
    """
    return _read(text, "the placement that this scene keeps")


def comparable(record: PlacementRecord) -> dict[str, Any]:
    """Return the content of a file without times and versions, which differ between machines and runs."""
    return {key: value for key, value in record.as_json().items() if key not in {"times", "versions"}}


def _read(text: str | bytes, name: str) -> PlacementRecord:
    return read_record(PlacementRecord, text, SCHEMA, name, "place the sensors again")
