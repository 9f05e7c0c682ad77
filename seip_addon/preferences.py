"""Add-on preferences, for all files.

`tests/addon/test_sensor_types.py` shows its use.
"""

import sys
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

import bpy

from .core.base.errors import SeipError
from .core.programs.sumo_installation import BY_HAND, installed_sumo
from .core.programs.sumo_programs import Sumo, find_sumo, sumo_version
from .core.sensing.lidar.catalogue import load_catalogue
from .core.sensing.lidar.model import LidarModel
from .core.sensing.visibility.store import GridFolder
from .core.workflows.detection import DetectingPython
from .core.world.openstreetmap.overpass import EXPORT, OVERPASS, OverpassServer

Value = TypeVar("Value")

ADDON_ID = (__package__ or "").removesuffix(".seip_addon")
"""The extension's key among Blender's add-ons: not that of the package in it."""
NO_SUMO = "SUMO is missing, which lays out the streets of an extract and simulates traffic"
_OFFLINE = "Blender may not go online: switch on Allow Online Access in Preferences, System,"
OFFLINE = f"{_OFFLINE} or {BY_HAND}"
NO_PIP = f"This Blender has no pip to install SUMO with: {BY_HAND}"


def cache_folder() -> Path:
    """Return the folder in which visibility is kept."""
    named = _given("cache", "")
    return Path(bpy.path.abspath(named)) if named else _own_folder("visibility")


def _own_folder(name: str) -> Path:
    """Return a folder of the extension's own, which may not exist."""
    if ADDON_ID.startswith("bl_ext."):
        return Path(bpy.utils.extension_path_user(ADDON_ID, path=name))
    return Path(bpy.utils.resource_path("USER")) / "seip" / name  # run from a checkout


def detecting_python() -> DetectingPython | None:
    """Return the Python that detection runs in, or None where nobody has named one and this one cannot be it."""
    if named := _given("python", ""):
        program = Path(bpy.path.abspath(named)).absolute()  # not resolved: .venv/bin/python is a link
        return DetectingPython(program, program.parent.parent.parent)
    project = find_spec("headless")
    if bpy.app.module and project is not None and project.origin is not None and find_spec("torch") is not None:
        return DetectingPython(Path(sys.executable), Path(project.origin).parents[1])
    return None


def sumo_folders() -> tuple[Path, ...]:
    """Return the folders that are searched for SUMO first: the one in the preferences, then the extension's own."""
    named = _given("sumo", "")
    return (*((Path(bpy.path.abspath(named)),) if named else ()), installed_sumo(own_sumo_folder()))


def own_sumo_folder() -> Path:
    """Return the extension's folder for SUMO, which may not exist."""
    return _own_folder("sumo")


def sumo() -> Sumo | None:
    """Return the programs of SUMO, or None if it is missing."""
    try:
        return find_sumo(sumo_folders())
    except SeipError:
        return None


def sumo_status() -> tuple[str, bool]:
    """Return which SUMO there is and where, that it is missing or does not start, and whether it can be used."""
    programs = sumo()
    if programs is None:
        return NO_SUMO, False
    try:
        version = _version(programs, programs.netconvert.stat().st_mtime_ns)
    except SeipError as error:
        return str(error), False
    return f"SUMO {version} in {programs.netconvert.parent}", True


@lru_cache(maxsize=1)
def _version(programs: Sumo, _changed: int) -> str:
    """Return the version of SUMO, which is asked for once as long as the program stays the same."""
    return sumo_version(programs)


def pip() -> list[str]:
    """Return the command that starts pip in Blender's Python, empty without pip."""
    package = find_spec("pip")
    if package is None or package.origin is None:
        return []
    return [sys.executable, *bpy.app.python_args, str(Path(package.origin).parent)]


def why_no_installation() -> str:
    """Return why SUMO cannot be installed from here, or ""."""
    if not bpy.app.online_access:
        return OFFLINE
    return "" if pip() else NO_PIP


def why_no_download() -> str:
    """Return why no extract can be downloaded, or ""."""
    return "" if bpy.app.online_access else f"{_OFFLINE} {EXPORT}"


def overpass() -> OverpassServer:
    """Return the server that extracts are downloaded from; without one of the user's own the public one."""
    return OverpassServer(_own_folder("openstreetmap"), _given("overpass", "") or OVERPASS, why_no_download())


def cores() -> int | None:
    """Return the number of threads for visibility, or None if it is not set."""
    return _given("cores", None)


def catalogue_files() -> tuple[Path, ...]:
    """Return the user's own catalogues."""
    files: Any = _given("catalogues", ())
    return tuple(Path(bpy.path.abspath(file.path)) for file in files if file.path)


def catalogue() -> dict[str, LidarModel]:
    """Return all sensor types there are, the user's own included."""
    return load_catalogue(catalogue_files())


def kept_visibility() -> GridFolder:
    """Return the visibility that is kept from run to run."""
    return GridFolder(cache_folder())


def own() -> Any:  # noqa: ANN401  # the properties of Blender's class are not known to types
    """Return the add-on's preferences; None where it was not enabled as an add-on."""
    add_on = bpy.context.preferences.addons.get(ADDON_ID)
    return None if add_on is None else add_on.preferences


def _given(name: str, otherwise: Value) -> Value:
    """Return a preference, or another value where the add-on has none."""
    value: Value = getattr(own(), name, otherwise)
    return value
