"""The shared libraries that Blender's module and SUMO expect of a Linux system, and the packages that hold them."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Mapping

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
SUMO_PACKAGES = {"libatomic.so.1": "libatomic1"}
"""What Eclipse SUMO expects besides."""


def missing_libraries(packages: Mapping[str, str] = DEBIAN_PACKAGES) -> dict[str, str]:
    """Return the libraries that are missing here, each with its Debian package: those of ``import bpy`` and renders."""
    if not sys.platform.startswith("linux"):
        return {}
    return {library: package for library, package in packages.items() if not _loads(library)}


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
