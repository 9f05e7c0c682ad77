"""Files of arrays written without the product's own code, so that they can hold anything."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path

import numpy as np


def contents(path: Path) -> tuple[dict, dict[str, np.ndarray]]:
    """Return the header and the arrays of a file, without its digest."""
    with np.load(path) as stored:
        arrays = {name: stored[name] for name in stored.files}
    header = json.loads(str(arrays.pop("header")))
    header.pop("digest", None)
    return header, arrays


def write(path: Path, header: dict, arrays: dict[str, np.ndarray], version: int = 1) -> Path:
    """Write a file of the version that has no digest: what is wrong with it is its content alone."""
    np.savez_compressed(path, header=np.array(json.dumps({**header, "version": version})), **arrays)
    return path


def claiming(path: Path, name: str, shape: tuple[int, ...]) -> Path:
    """Let an array of a file claim another shape than it has."""
    with zipfile.ZipFile(path) as archive:
        members = {member: archive.read(member) for member in archive.namelist()}
    array = np.lib.format.read_array(io.BytesIO(members[f"{name}.npy"]))
    content = io.BytesIO()
    header = {"descr": array.dtype.str, "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(content, header)
    members[f"{name}.npy"] = content.getvalue() + array.tobytes()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for member, data in members.items():
            archive.writestr(member, data)
    return path
