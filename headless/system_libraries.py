"""The shared libraries that Blender's module expects of a Linux system, and the packages that hold them."""

from __future__ import annotations

import ctypes
import sys

DEBIAN_PACKAGES = {
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",  # loaded when Workbench or EEVEE renders: without it Blender ends the whole process
    "libICE.so.6": "libice6",
    "libSM.so.6": "libsm6",
    "libX11.so.6": "libx11-6",
    "libXext.so.6": "libxext6",
    "libXfixes.so.3": "libxfixes3",
    "libXi.so.6": "libxi6",
    "libXrender.so.1": "libxrender1",
    "libxkbcommon.so.0": "libxkbcommon0",
}


def missing_libraries() -> list[str]:
    """Return the names of the libraries that ``import bpy`` or a render would miss here."""
    if not sys.platform.startswith("linux"):
        return []
    return [library for library in DEBIAN_PACKAGES if not _loads(library)]


def cure(missing: list[str]) -> str:
    """Return the one sentence that names missing libraries and the line that installs them."""
    packages = " ".join(sorted(DEBIAN_PACKAGES[library] for library in missing))
    return (
        f"Blender's module needs {', '.join(missing)}, which this system lacks; "
        f"install with: apt-get install --no-install-recommends {packages}"
    )


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True
