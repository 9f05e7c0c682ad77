"""Registration of the add-on's classes, in order."""

import importlib
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

import bpy

PARTS = (
    "session", "overlays", "work", "layout", "preferences", "survey", "sensors", "object_roles", "site_check",
    "junction_map", "site", "objective", "traffic", "scans", "coverage", "following", "results", "export", "detection",
    "placement", "sidebar", "events",
)  # fmt: skip
"""Modules of the panel, whose classes are registered in the order of their definition.

Other registrations are in tables of the module: ``PROPERTIES`` (owner, name, property), ``HANDLERS`` (event, function),
``MENUS`` (menu, function), ``AT_START`` (functions to call once the open file can be read) and ``TIMERS`` (functions
that may be waiting). A function ``forget`` ends what must not outlive the open file.
"""

_registered: list[ModuleType] = []


def register() -> None:
    """Register all parts."""
    for part in [importlib.import_module(f".panel.{name}", __package__) for name in PARTS]:
        for one in _classes(part):
            bpy.utils.register_class(one)
        _registered.append(part)
        _attach(part)
    bpy.app.handlers.load_pre.append(_forget)


def unregister() -> None:
    """Remove all parts, the last first."""
    bpy.app.handlers.load_pre.remove(_forget)
    _forget()
    while _registered:
        part = _registered.pop()
        _detach(part)
        for one in reversed(_classes(part)):
            bpy.utils.unregister_class(one)


def _attach(part: ModuleType) -> None:
    """Add the entries of a module's tables to Blender."""
    for owner, name, value in getattr(part, "PROPERTIES", ()):
        setattr(owner, name, value)
    for functions, function in _lists(part):
        functions.append(function)
    for function in getattr(part, "AT_START", ()):
        if isinstance(bpy.data, bpy.types.BlendData):
            function()
        else:  # Blender lets nobody look at the open file while it registers an add-on
            bpy.app.timers.register(function, first_interval=0.0)


def _detach(part: ModuleType) -> None:
    """Remove what `_attach` added, and cancel timers."""
    for function in (*getattr(part, "TIMERS", ()), *getattr(part, "AT_START", ())):
        if bpy.app.timers.is_registered(function):
            bpy.app.timers.unregister(function)
    for functions, function in _lists(part):
        functions.remove(function)
    for owner, name, _ in getattr(part, "PROPERTIES", ()):
        delattr(owner, name)


def _lists(part: ModuleType) -> Iterator[tuple[Any, Callable[..., None]]]:
    """Yield Blender's lists of handlers, and its menus, with the functions that a module has for them."""
    for event, function in getattr(part, "HANDLERS", ()):
        # persistent: also after another file is opened
        yield getattr(bpy.app.handlers, event), bpy.app.handlers.persistent(function)
    yield from ((getattr(bpy.types, menu), function) for menu, function in getattr(part, "MENUS", ()))


def _classes(part: ModuleType) -> list[type]:
    """Return the classes for Blender that a module defines, in order."""
    own = (one for one in vars(part).values() if isinstance(one, type) and one.__module__ == part.__name__)
    return [one for one in own if issubclass(one, bpy.types.bpy_struct)]


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _forget(*_: object) -> None:
    """Let go of the open file: another is about to be opened, or the add-on is disabled."""
    for part in reversed(_registered):
        if hasattr(part, "forget"):
            part.forget()
