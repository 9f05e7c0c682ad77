"""Conversion of what a person typed into a property."""

from __future__ import annotations

from pathlib import Path

import bpy


def absolute(text: str) -> Path:
    """Return a path that may be relative to the .blend."""
    return Path(bpy.path.abspath(text))


def as_typed(value: float) -> float:
    """Return the number that a person typed: Blender keeps it in single precision, 0.3 as 0.30000001."""
    return float(f"{value:.7g}")
