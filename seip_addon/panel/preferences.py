"""The add-on's preferences, for all files, and the installation of SUMO.

`tests/addon/test_sensor_types.py` shows its use.
"""

from __future__ import annotations

import sys
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

import bpy

from ..core.base.errors import SeipError
from ..core.programs.sumo_installation import BY_HAND, DOWNLOAD_SIZE, install_sumo, installed_sumo
from ..core.programs.sumo_programs import Sumo, find_sumo, sumo_version
from ..core.sensing.lidar.catalogue import load_catalogue
from ..core.sensing.lidar.model import LidarModel
from ..core.workflows.detection import INSTALL, DetectingPython
from ..core.world.openstreetmap.overpass import EXPORT, OVERPASS, OverpassServer
from .layout import draw_run, draw_sentence
from .properties import absolute
from .work import Job, LongWork, Outcome

ADDON_ID = (__package__ or "").removesuffix(".panel").removesuffix(".seip_addon")
"""The extension's key among Blender's add-ons: not that of the package in it."""
NO_SUMO = "SUMO is missing, which lays out the streets of an extract and simulates traffic"
_OFFLINE = "Blender may not go online: switch on Allow Online Access in Preferences, System,"
OFFLINE = f"{_OFFLINE} or {BY_HAND}"
NO_PIP = f"This Blender has no pip to install SUMO with: {BY_HAND}"


Value = TypeVar("Value")


def cache_folder() -> Path:
    """Return the folder in which visibility is kept."""
    named = _given("cache", "")
    return absolute(named) if named else _own_folder("visibility")


def _own_folder(name: str) -> Path:
    """Return a folder of the extension's own, which may not exist."""
    if ADDON_ID.startswith("bl_ext."):
        return Path(bpy.utils.extension_path_user(ADDON_ID, path=name))
    return Path(bpy.utils.resource_path("USER")) / "seip" / name  # run from a checkout


def detecting_python() -> DetectingPython | None:
    """Return the Python that detection runs in, or None where nobody has named one and this one cannot be it."""
    if named := _given("python", ""):
        program = absolute(named).absolute()  # not resolved: .venv/bin/python is a link
        return DetectingPython(program, program.parent.parent.parent)
    project = find_spec("headless")
    if bpy.app.module and project is not None and project.origin is not None and find_spec("torch") is not None:
        return DetectingPython(Path(sys.executable), Path(project.origin).parents[1])
    return None


def sumo_folders() -> tuple[Path, ...]:
    """Return the folders that are searched for SUMO first: the one in the preferences, then the extension's own."""
    named = _given("sumo", "")
    return (*((absolute(named),) if named else ()), installed_sumo(own_sumo_folder()))


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


def catalogue_files() -> tuple[Path, ...]:
    """Return the user's own catalogues."""
    files: Any = _given("catalogues", ())
    return tuple(absolute(file.path) for file in files if file.path)


def catalogue() -> dict[str, LidarModel]:
    """Return all sensor types there are, the user's own included."""
    return load_catalogue(catalogue_files())


def own() -> Any:  # noqa: ANN401  # the properties of Blender's class are not known to types
    """Return the add-on's preferences; None where it was not enabled as an add-on."""
    add_on = bpy.context.preferences.addons.get(ADDON_ID)
    return None if add_on is None else add_on.preferences


def _given(name: str, otherwise: Value) -> Value:
    """Return a preference, or another value where the add-on has none."""
    value: Value = getattr(own(), name, otherwise)
    return value


class SEIP_OT_install_sumo(LongWork, bpy.types.Operator):
    """Download Eclipse SUMO from PyPI into the extension's own folder, where it takes up to 470 MB. It lays out the streets of an extract of OpenStreetMap and simulates traffic"""  # noqa: E501  # a tooltip is one line

    bl_label = "Install SUMO"
    bl_options = {"REGISTER"}  # nothing in the file changes
    stopped_message = "stopped; SUMO was not installed"

    obstacles = (lambda _: why_no_installation(),)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event | None) -> Outcome:
        """Start in the main window: work ends with its window, and that of the preferences is soon closed."""
        main = next((window for window in context.window_manager.windows if window.parent is None), context.window)
        with context.temp_override(window=main):
            return super().invoke(context, event)

    def job(self, _scene: bpy.types.Scene) -> Job:
        """Install it, and report what is there now."""
        yield install_sumo(pip(), own_sumo_folder())
        self.report({"INFO"}, sumo_status()[0])


def draw_missing(layout: bpy.types.UILayout) -> None:
    """Draw that SUMO is missing, and the ways to get it; nothing where it is there."""
    if sumo() is None:
        draw_status(layout)
        draw_preferences(layout)


def draw_preferences(layout: bpy.types.UILayout) -> None:
    """Draw the button that shows the add-on's preferences, if it has any."""
    if own() is not None:
        layout.operator("preferences.addon_show", text="Preferences").module = ADDON_ID


def draw_status(layout: bpy.types.UILayout) -> None:
    """Draw the SUMO in use, or the button that installs it, and why it cannot."""
    status, works = sumo_status()
    draw_sentence(layout, f"{status}.", icon="CHECKMARK" if works else "ERROR")
    if works:
        return
    if reason := why_no_installation():
        draw_sentence(layout, f"{reason}.", icon="INFO")
    text = f"{SEIP_OT_install_sumo.bl_label} ({DOWNLOAD_SIZE} MB)"
    draw_run(layout, "seip.install_sumo", icon="IMPORT", text=text)


class SEIP_PG_catalogue_file(bpy.types.PropertyGroup):
    """A catalogue of the user's own."""

    path: bpy.props.StringProperty(
        name="Catalogue", subtype="FILE_PATH", description="A TOML file of LiDAR models, as docs/sensors.md describes"
    )


class SEIP_AP_preferences(bpy.types.AddonPreferences):
    """Preferences of the add-on."""

    bl_idname = ADDON_ID

    cache: bpy.props.StringProperty(
        name="Cache",
        subtype="DIR_PATH",
        description="Folder for stored visibility grids; empty for the extension's own folder",
    )
    python: bpy.props.StringProperty(
        name="Python with PyTorch",
        subtype="FILE_PATH",
        description=f"Python for Detect, .venv/bin/python of a checkout or one of your own: {INSTALL}",
    )
    sumo: bpy.props.StringProperty(
        name="SUMO",
        subtype="DIR_PATH",
        description="Folder of Eclipse SUMO, which lays out the streets of an extract of OpenStreetMap and simulates "
        "traffic: the one with bin and data in it. Empty for the SUMO that was installed here, on the PATH or in "
        "SUMO_HOME",
    )
    overpass: bpy.props.StringProperty(
        name="Overpass",
        description="Address of the Overpass server that extracts of OpenStreetMap are downloaded from",
        default=OVERPASS,
    )
    catalogues: bpy.props.CollectionProperty(type=SEIP_PG_catalogue_file)

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the preferences."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "cache")
        layout.prop(self, "python")
        layout.prop(self, "sumo")
        draw_status(layout)
        layout.prop(self, "overpass")
        layout.label(text="Catalogues of sensor types")
        for number, file in enumerate(self.catalogues):
            row = layout.row(align=True)
            row.prop(file, "path", text="")
            row.operator("seip.remove_catalogue", text="", icon="X").index = number
        layout.operator("seip.add_catalogue", icon="ADD")
