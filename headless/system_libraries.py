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


def missing_libraries() -> dict[str, str]:
    """Return the libraries that ``import bpy`` or a render would miss here, each with its Debian package."""
    if not sys.platform.startswith("linux"):
        return {}
    return {library: package for library, package in DEBIAN_PACKAGES.items() if not _loads(library)}


def complaint(missing: dict[str, str]) -> str:
    """Return the one sentence that names what is missing and the line that installs its packages."""
    packages = " ".join(missing.values())
    return f"this system lacks {', '.join(missing)}; install with: apt-get install --no-install-recommends {packages}"


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True
