"""``placement.json`` as a file, and as the text that a scene keeps.

`tests/core/output/results/test_placement_record.py` shows its use.
"""

import json
import math
import os
from functools import lru_cache
from pathlib import Path
from typing import Any

from ...errors import SeipError
from ...storage.files import save_json
from ...storage.json_dataclass import from_json
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
    return _read(text.encode(), "the placement that this scene keeps")


def comparable(record: PlacementRecord) -> dict[str, Any]:
    """Return the content of a file without times and versions, which differ between machines and runs."""
    return {key: value for key, value in record.as_json().items() if key not in {"times", "versions"}}


def _read(text: bytes, where: str) -> PlacementRecord:
    try:
        content = json.loads(text.decode(), parse_float=_finite, parse_constant=_finite)
        schema = content.get("schema") if isinstance(content, dict) else None
        if schema == SCHEMA:
            record = from_json(PlacementRecord, content)
            _ = record.request, record.text().encode()  # refused if these cannot be read or written again
            return record
    except (SeipError, ValueError, RecursionError) as error:
        raise SeipError(f"{where} is damaged or no placement: {error}; place the sensors again") from error
    raise SeipError(f"{where} has the schema {schema!r}, not {SCHEMA!r}; place the sensors again with this version")


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text} is no finite number")
    return value
