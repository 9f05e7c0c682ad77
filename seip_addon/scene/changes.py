"""Detection of changes to a scene since it was read.

Blender reports what it evaluates again: objects that move or change their shape.
What it does not report, such as objects that come and go, is in a digest of
places and properties that takes no look at any vertex.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from weakref import WeakSet

import bpy

from ..core.storage.files import digest
from . import contract

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
    changed : bool
        Whether something happened to them since.
    """

    scene: int
    objects: frozenset[int]
    fingerprint: str
    changed: bool = False

    def look(self, scene: bpy.types.Scene) -> bool:
        """Return whether the scene has changed, after looking at what Blender does not report."""
        scene.view_layers[0].update()  # what Blender has put off until now is reported first
        self.changed = self.changed or _fingerprint(_sources(scene), scene) != self.fingerprint
        return self.changed


_watches: WeakSet[Watch] = WeakSet()


def watch(scene: bpy.types.Scene) -> Watch:
    """Begin to watch a scene, for as long as somebody holds the watch."""
    scene.view_layers[0].update()
    sources = _sources(scene)
    new = Watch(scene.session_uid, frozenset(obj.session_uid for obj in sources), _fingerprint(sources, scene))
    _watches.add(new)
    return new


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
