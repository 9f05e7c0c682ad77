"""Named places of a map, as a scene keeps them: streets and crossings in plan."""

from __future__ import annotations

import json
from collections.abc import Iterable

import bpy
import shapely

from ..core.base.errors import SeipError
from ..core.site.scene_geometry import NamedArea
from . import contract

DECIMALS = 3  # of metres, to which outlines are rounded
KINDS = ("crossing", "track")


def places_text(places: Iterable[NamedArea]) -> str:
    """Return places as the text of the scene property `contract.PLACES`: JSON, name, outline (WKT) and kind of each.

    The kind is ``crossing`` for pedestrian crossings, ``track`` for tracks of trams or trains, and missing for streets.
    """
    return json.dumps(
        [
            [
                *(one.name, shapely.to_wkt(one.polygon, rounding_precision=DECIMALS)),
                *(kind for kind in KINDS if getattr(one, kind)),
            ]
            for one in places
        ]
    )


def places_of(scene: bpy.types.Scene) -> tuple[NamedArea, ...]:
    """Return the places that a scene keeps; none where it keeps none.

    Raises
    ------
    SeipError
        The property is not what `places_text` writes.
    """
    text = scene.get(contract.PLACES, "[]")
    try:
        places = [
            NamedArea(
                *(str(name), shapely.make_valid(shapely.from_wkt(outline))), **{one: kind == [one] for one in KINDS}
            )
            for name, outline, *kind in json.loads(text)
        ]
    except (TypeError, ValueError, RecursionError, shapely.errors.ShapelyError) as error:
        raise SeipError(
            f"scene property {contract.PLACES} holds no named places: delete it, or build the scene again"
        ) from error
    return tuple(places)
