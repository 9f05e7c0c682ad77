"""Detection of changes to a scene since it was read.

Blender reports what it evaluates again: objects that move or change their shape.
What it does not report, such as objects that come and go, is in a digest of
places and properties that takes no look at any vertex.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any
from weakref import WeakSet

import bpy
from numpy.typing import NDArray

from ..core.base.errors import SeipError
from ..core.storage.files import digest
from . import contract
from .read import shown_parts

SCENE_PROPERTIES = (
    *(contract.ORIGIN, contract.MAP, contract.GEO_REFERENCE, contract.HEADER_OFFSET),
    *(contract.PLACES, contract.ATTRIBUTION),
)
"""Custom properties of the scene itself that are read with it."""


@dataclass(eq=False)
class Watch:
    """A scene as it was at one moment.

    Parameters
    ----------
    scene : int
        Its session number.
    objects : frozenset of int
        Session numbers of the objects that it is read from.
    fingerprint : str
        Digest of their names, places and properties.
    surfaces : str
        Digest of their surfaces as the viewport shows them.
    changed : bool
        Whether something happened to them since, as far as it was reported.
    """

    scene: int
    objects: frozenset[int]
    fingerprint: str
    surfaces: str
    changed: bool = False

    def look(self, scene: bpy.types.Scene) -> bool:
        """Return whether the scene differs, including what Blender does not report; a change may have been undone."""
        scene.view_layers[0].update()  # what Blender has put off until now is reported first
        differs = _fingerprint(_sources(scene), scene) != self.fingerprint
        self.changed = differs or (self.changed and _surfaces(scene) != self.surfaces)
        return self.changed


_watches: WeakSet[Watch] = WeakSet()


def watch(scene: bpy.types.Scene) -> Watch:
    """Begin to watch a scene, for as long as somebody holds the watch."""
    scene.view_layers[0].update()
    sources = _sources(scene)
    objects = frozenset(obj.session_uid for obj in sources)
    new = Watch(scene.session_uid, objects, _fingerprint(sources, scene), _surfaces(scene))
    _watches.add(new)
    return new


def look_again(scene: bpy.types.Scene) -> None:
    """Look whether what was reported as changed in a scene is as it was: after undo and redo."""
    for one in [one for one in _watches if one.scene == scene.session_uid and one.changed]:
        with suppress(SeipError):  # a mesh is damaged: the scene is not as it was
            one.look(scene)


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def on_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Note what Blender evaluated again; a handler of ``depsgraph_update_post``."""
    concerned = [one for one in _watches if one.scene == scene.session_uid and not one.changed]
    if not concerned:
        return
    objects = [update for update in depsgraph.updates if isinstance(update.id, bpy.types.Object)]
    affected = {u.id.original.session_uid for u in objects if u.is_updated_transform or u.is_updated_geometry}
    rebuilt = any(not (update.is_updated_transform or update.is_updated_geometry) for update in objects)
    fingerprint = _fingerprint(_sources(scene), scene) if rebuilt else None  # not at every step of a drag
    for one in concerned:
        one.changed = bool(affected & one.objects) or (rebuilt and fingerprint != one.fingerprint)


def _sources(scene: bpy.types.Scene) -> set[bpy.types.Object]:
    """Return the objects that a scene is read from, those within instanced collections included."""
    found: set[bpy.types.Object] = set()
    waiting = set().union(*contract.members(scene).values())
    while waiting:
        obj = waiting.pop()
        found.add(obj)
        if obj.instance_type == "COLLECTION" and obj.instance_collection is not None:
            waiting |= set(obj.instance_collection.all_objects) - found
    return found


def _fingerprint(sources: Iterable[bpy.types.Object], scene: bpy.types.Scene) -> str:
    layer = scene.view_layers[0]
    roles = contract.members(scene)
    lines = sorted(
        repr((_traits(obj, layer), [n for n, objects in roles.items() if obj in objects])) for obj in sources
    )
    stored = [scene.get(name) for name in SCENE_PROPERTIES]
    place = (repr(value.to_list() if hasattr(value, "to_list") else value) for value in stored)
    units = repr((scene.unit_settings.system, scene.unit_settings.scale_length))
    return digest(*place, units, repr(scene.get(contract.TITLE, scene.name)), *lines)


def _surfaces(scene: bpy.types.Scene) -> str:
    """Return a digest of all that is read of surfaces; it takes a tenth of a second for a large site."""
    parts: list[NDArray[Any] | str] = []
    for part in shown_parts(scene, contract.members(scene)):
        parts += [part.name, part.fault, part.matrix]
        parts += [array for array in (part.triangles, part.reflectivity) if array is not None]
    return digest(*parts)


def _traits(obj: bpy.types.Object, layer: bpy.types.ViewLayer) -> tuple[object, ...]:
    """Return what of an object may change without a report; of its shape no more than its name."""
    return (
        obj.name_full,
        tuple(value for row in obj.matrix_world for value in row),
        None if obj.data is None else obj.data.name_full,
        obj.hide_viewport,
        obj.name in layer.objects and obj.visible_get(view_layer=layer),
        None if obj.instance_collection is None else obj.instance_collection.name_full,
        obj.instance_type,
        *(repr(obj.get(name)) for name in (contract.WEIGHT, contract.FORBIDDEN, contract.MANDATORY)),
        *((modifier.type, modifier.show_viewport) for modifier in obj.modifiers),
    )
