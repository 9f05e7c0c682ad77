"""Blender's properties made from settings of the core, and what users typed into them.

`tests/addon/test_sensor_types.py` shows its use.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..core.base.errors import SeipError
from ..core.base.settings import settings_of
from ..core.workflows.traffic_runs import traffic_folder

_KINDS = {bool: BoolProperty, int: IntProperty, float: FloatProperty, str: EnumProperty}
_UNITS = {"m": {"unit": "LENGTH"}, "rad": {"subtype": "ANGLE"}}


def of_setting(kind: type, field: str, name: str, **more: Any) -> Any:  # noqa: ANN401 -- what Blender makes of a property
    """Return the property of a field of a settings class, with its default, limits, unit and description.

    A field without a default, such as a file, is a text that is empty where nothing is given.

    Parameters
    ----------
    name : str
        As the panel shows it.
    **more
        What Blender's property takes beside, or in place of that: soft limits, steps, the items of a choice.
    """
    about, default = settings_of(kind)[field]
    limits = {"min": about.minimum, "max": about.maximum}
    given = {name: limit for name, limit in limits.items() if limit is not None}
    description = about.help[0].upper() + about.help[1:]
    if isinstance(default, tuple):  # several of the items of a choice
        return EnumProperty(name=name, description=description, default=set(default), options={"ENUM_FLAG"}, **more)
    default = more.get("default", default)
    if default is None:
        return StringProperty(name=name, description=description, **more)
    arguments = {"default": default} | given | _UNITS.get(about.unit, {}) | more
    return _KINDS[type(default)](name=name, description=description, **arguments)


def path_property(name: str, description: str, *, folder: bool = False, default: str = "") -> Any:  # noqa: ANN401 -- as above
    """Return the property of a file or folder, which may be relative to the .blend; one with a default is written."""
    output = {"OUTPUT_PATH"} if default else set()
    return StringProperty(
        name=name,
        description=description,
        subtype="DIR_PATH" if folder else "FILE_PATH",
        default=default,
        options={"PATH_SUPPORTS_BLEND_RELATIVE"} | output,
    )


def absolute(text: str) -> Path:
    """Return a path that may be relative to the .blend."""
    return Path(bpy.path.abspath(text))


def saved_path(named: str, what: str) -> Path:
    """Return a path for a purpose, "the scans".

    Raises
    ------
    SeipError
        None is named, or it is beside the file, and the file has not been saved.
    """
    if not named:
        raise SeipError(f"name a folder to write {what} to")
    if named.startswith("//") and not bpy.data.filepath:
        raise SeipError(
            f"the path {named} of {what} is beside the file, and the file has not been saved: save it first, or "
            "choose another"
        )
    return absolute(named)


def runs_folder(named: str) -> Path:
    """Return the folder with runs of traffic: the one that is named, else that beside the file; see `saved_path`."""
    path = saved_path(named or "//", "the runs of traffic")
    return path if named else traffic_folder(Path(bpy.data.filepath))


def complaint(read: Callable[[], object]) -> str:
    """Return the sentence of the `SeipError` that a function raises, or ""."""
    try:
        read()
    except SeipError as error:
        return str(error)
    return ""


def as_typed(value: float) -> float:
    """Return the number that a person typed: Blender keeps it in single precision, 0.3 as 0.30000001."""
    return float(f"{value:.7g}")
