"""The coverage on the road: its legend, and whether a view shows its colours."""

import bpy

from ..core.pictures.palette import rgb
from ..overlay import Block, Entry, Overlay
from ..scene.write import CLASS_COLOURS, CLASS_WORDS, SHARES, coverage_of

NAME = "coverage"
SHOWN_BY = {"MATERIAL", "VERTEX"}  # ways to colour Solid shading that show the coverage


def coverage_overlay() -> Overlay:
    """Return the legend of whatever colours the coverage has; the mesh itself is Blender's to draw."""
    return Overlay((), legend_of_coverage)


def legend_of_coverage(scene: bpy.types.Scene) -> Block | None:
    """Return what the colours of a scene's coverage mean, None where there is none."""
    obj = coverage_of(scene)
    if obj is None or CLASS_WORDS not in obj:
        return None
    rows = zip(obj[CLASS_WORDS], obj[CLASS_COLOURS], obj[SHARES], strict=True)
    entries = tuple(Entry(f"{words}  {share:.1%}", ((*rgb(colour), 1.0),)) for words, colour, share in rows)
    return Block("Coverage", entries)


def shows_coverage(space: bpy.types.SpaceView3D) -> bool:
    """Return whether a view's shading shows the colours of the coverage."""
    shading = space.shading
    return shading.type in {"MATERIAL", "RENDERED"} or (shading.type == "SOLID" and shading.color_type in SHOWN_BY)


def set_shading(space: bpy.types.SpaceView3D) -> None:
    """Set a view's shading so that it shows the colours of the coverage."""
    space.shading.type = "SOLID"
    space.shading.color_type = "MATERIAL"
