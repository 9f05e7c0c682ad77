"""Versions of the program and its libraries, which every record states.

`tests/core/output/results/test_placement_record.py` shows their use.
"""

import importlib.util
import platform
import tomllib
from importlib import metadata
from pathlib import Path

LIBRARIES = ("numpy", "shapely", "pulp", "highspy")
MANIFEST = Path(__file__).parents[4] / "blender_manifest.toml"


def versions(**more: str) -> dict[str, str]:
    """Return the versions of this program, of Python and of the libraries that results depend on, and ``more``."""
    if MANIFEST.is_file():
        program = tomllib.loads(MANIFEST.read_text(encoding="utf-8"))["version"]
    else:  # installed by pip
        program = metadata.version("seip")
    there = {name for name in LIBRARIES if importlib.util.find_spec(name)}  # HiGHS need not be
    libraries = {name: metadata.version(name) for name in LIBRARIES if name in there}
    return {"seip": program, "python": platform.python_version(), **libraries, **more}
