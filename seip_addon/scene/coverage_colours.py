"""Colours of the coverage in a scene: classes of one's own, other numbers of sensors, other aspects."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.base.arrays import Float, Integer
from ..core.base.errors import SeipError
from ..core.output.pictures.colours import Aspect, Colouring, as_placed, colouring
from .write import ASPECT, RETURNS, SEEN_BY, TARGET_WEIGHT, aspects_of, coverage_of, paint


def recolour(scene: bpy.types.Scene, colours: Colouring) -> None:
    """Colour the squares of the coverage by classes of one's own.

    Parameters
    ----------
    colours : Colouring
        Of the targets that the coverage was written for, in their order.

    Raises
    ------
    SeipError
        There is no coverage, or it is of other targets.
    """
    obj = _shown_coverage(scene)
    if len(obj.data.polygons) != len(colours.of):
        raise SeipError(f"scene {scene.name!r} shows the coverage of other targets: place sensors again")
    paint(obj, colours)


def show_seen_by(scene: bpy.types.Scene, seen_by: Integer, returns: Float | None = None) -> None:
    """Show how many sensors see each target, under the aspect that is shown.

    Parameters
    ----------
    seen_by : (t,) int64
        How many sensors see each target, in the order of those that the coverage was written for.
    returns : (t,) float64, optional
        Expected returns from a pedestrian near each target, if they have changed.

    Raises
    ------
    SeipError
        There is no coverage, or it is of other targets.
    """
    obj = _shown_coverage(scene)
    aspect = obj.get(ASPECT) or aspects_of(obj)[0]  # nothing is compared any longer
    recolour(scene, as_placed(seen_by))
    obj.data.attributes[SEEN_BY].data.foreach_set("value", seen_by.astype(np.int32))
    if returns is not None and RETURNS in obj.data.attributes:
        obj.data.attributes[RETURNS].data.foreach_set("value", returns.astype(np.float32))
    colour_coverage(scene, aspect)


def colour_coverage(scene: bpy.types.Scene, aspect: Aspect) -> None:
    """Colour the coverage by one aspect, from what the mesh itself knows of its targets.

    Raises
    ------
    SeipError
        There is no coverage, or it has no returns to show.
    """
    obj = _shown_coverage(scene)
    attributes = obj.data.attributes
    seen_by = np.empty(len(obj.data.polygons), dtype=np.int32)
    weight = np.ones(len(seen_by), dtype=np.float32)  # a mesh of an earlier version has none
    attributes[SEEN_BY].data.foreach_get("value", seen_by)
    if TARGET_WEIGHT in attributes:
        attributes[TARGET_WEIGHT].data.foreach_get("value", weight)
    returns = None
    if RETURNS in attributes:
        returns = np.empty(len(seen_by), dtype=np.float32)
        attributes[RETURNS].data.foreach_get("value", returns)
    paint(obj, colouring(aspect, seen_by.astype(np.int64), weight.astype(np.float64), returns))
    obj[ASPECT] = aspect


def _shown_coverage(scene: bpy.types.Scene) -> bpy.types.Object:
    obj = coverage_of(scene)
    if obj is None:
        raise SeipError(f"scene {scene.name!r} shows no coverage: place sensors first")
    return obj
