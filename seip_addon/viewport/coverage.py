"""The coverage on the road: its legend, and whether a view shows its colours."""

from collections.abc import Iterator

import bpy

from ..core.output.pictures.palette import FORBIDDEN_VEIL, MANDATORY_VEIL, WEIGHTED_VEIL, rgb
from ..scene import contract
from ..scene.write import coverage_of, shown_legend
from ..state.overlay import Block, Entry, Overlay
from . import overlays
from .labels import labels_of_sensors

NAME = "coverage"
AREAS = (
    (contract.WEIGHTED_REGIONS, "weighted region", WEIGHTED_VEIL),
    (contract.FORBIDDEN_AREAS, "no sensor allowed", FORBIDDEN_VEIL),
    (contract.MANDATORY_AREAS, "sensor required", MANDATORY_VEIL),
)
"""Collections of areas with their words and colours in the legend."""
SHOWN_BY = {"MATERIAL", "VERTEX"}  # ways to colour Solid shading that show the coverage


def update(scene: bpy.types.Scene) -> None:
    """Show the legend where the scene wants one and has coverage, otherwise none."""
    if scene.seip.view.legend and coverage_of(scene) is not None:
        overlays.show(scene, NAME, Overlay((), legend_of_coverage, labels=labels_of_sensors))
    else:
        overlays.hide(scene, NAME)


def show_colours(scene: bpy.types.Scene) -> None:
    """Show a scene's coverage with its legend, in all views of Solid shading."""
    scene.seip.view.legend = True
    windows = (window for window in bpy.context.window_manager.windows if window.scene == scene)
    for view in (area.spaces.active for area in overlays.viewports(windows)):
        if view.shading.type == "SOLID" and not shows_coverage(view):
            set_shading(view)


def legend_of_coverage(scene: bpy.types.Scene) -> Block | None:
    """Return the block of the legend for a scene's coverage, None where there is none."""
    legend = shown_legend(scene)
    if legend is None:
        return None
    rows = zip(legend.words, legend.colours, legend.shares, strict=True)
    entries = tuple(Entry(f"{words}  {share:.1%}", ((*rgb(colour), 1.0),)) for words, colour, share in rows)
    return Block(legend.title, (*entries, *_areas(scene)))


def _areas(scene: bpy.types.Scene) -> Iterator[Entry]:
    """Yield an entry for each kind of area that the scene shows on the road or beside it."""
    layer = scene.view_layers[0]
    for name, words, colour in AREAS:
        collection = contract.find(scene, name)
        objects = () if collection is None else collection.all_objects
        if any(obj.visible_get(view_layer=layer) for obj in objects if obj.name in layer.objects):
            yield Entry(words, ((*rgb(colour), 1.0),))


def shows_coverage(space: bpy.types.SpaceView3D) -> bool:
    """Return whether a view's shading shows the colours of the coverage."""
    shading = space.shading
    return shading.type in {"MATERIAL", "RENDERED"} or (shading.type == "SOLID" and shading.color_type in SHOWN_BY)


def set_shading(space: bpy.types.SpaceView3D) -> None:
    """Set a view's shading so that it shows the colours of the coverage."""
    space.shading.type = "SOLID"
    space.shading.color_type = "MATERIAL"


def _after_load(*_: object) -> None:
    """Show what was shown when the file was saved."""
    for scene in bpy.data.scenes:
        update(scene)


HANDLERS = (("load_post", _after_load),)
AT_START = (_after_load,)
