"""Registration of the add-on's classes, in order."""

import importlib
from types import ModuleType

import bpy

PARTS = (
    "panels.preferences",
    "properties.site", "properties.survey", "properties.placement",
    "properties.traffic", "properties.simulation",
    "properties.sections", "properties.scene",
    "session", "scene_survey", "sensor_types", "loose_pieces",
    "viewport.beam_preview", "viewport.overlays", "viewport.coverage",
    "operators.base", "operators.site", "operators.street_map",
    "operators.sensors", "operators.placement", "live_coverage",
    "operators.results", "operators.view", "operators.traffic", "operators.simulation", "operators.detection",
    "operators.verification",
    "panels.sensors", "panels.site", "panels.placement", "panels.results", "panels.steps", "panels.front_door",
)  # fmt: skip
"""Modules of the add-on, whose classes are registered in the order of their definition.

Some have ``attach`` and ``detach`` for handlers, properties and menus, and some ``forget``, for what must not outlive
the open file.
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
        if hasattr(part, "attach"):
            part.attach()
    bpy.app.handlers.load_pre.append(_forget)


def unregister() -> None:
    """Remove all parts, the last first."""
    bpy.app.handlers.load_pre.remove(_forget)
    _forget()
    while _registered:
        part = _registered.pop()
        if hasattr(part, "detach"):
            part.detach()
        for one in reversed(_classes(part)):
            bpy.utils.unregister_class(one)


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
