"""Registration of the add-on's classes, in order."""

import importlib
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

import bpy

PARTS = (
    "panels.preferences",
    "properties.site", "properties.survey", "properties.placement",
    "properties.traffic",
    "properties.sections", "properties.scene",
    "state.session", "operators.scene_survey", "state.sensor_types", "state.loose_pieces",
    "viewport.overlays", "viewport.coverage",
    "operators.base", "operators.site", "operators.street_map",
    "operators.sensors", "operators.placement", "state.live_coverage",
    "operators.results", "operators.view", "operators.traffic", "operators.detection",
    "operators.verification",
    "panels.sensors", "panels.site", "panels.placement", "panels.results", "panels.steps", "panels.front_door",
)  # fmt: skip
"""Modules of the add-on, whose classes are registered in the order of their definition.

Other registrations are in tables of the module: ``PROPERTIES`` (owner, name, property), ``HANDLERS`` (event, function),
``MENUS`` (menu, function), ``AT_START`` (functions to call once the open file can be read) and ``TIMERS`` (functions
that may be waiting). A function ``forget`` ends what must not outlive the open file.
"""

_registered: list[ModuleType] = []


def register() -> None:
    """Register all parts, or say in the sidebar what they lack."""
    try:
        parts = [importlib.import_module(f".{name}", __package__) for name in PARTS]
    except ImportError as error:
        parts = [_incomplete(error)]
    for part in parts:
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
        yield (
            getattr(bpy.app.handlers, event),
            bpy.app.handlers.persistent(function),
        )  # also after another file is opened
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


def _incomplete(error: ImportError) -> ModuleType:
    """Return the part that stands in for all others where a package is missing or broken."""
    part = importlib.import_module(".panels.missing_package", __package__)
    part.MISSING = error.name or str(error)  # type: ignore[attr-defined]  # the panel's one fact
    return part
