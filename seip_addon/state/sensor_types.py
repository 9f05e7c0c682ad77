"""Sensor types: the catalogue in the session, for panels that only look, and each scene's list of keys."""

import bpy

from .. import preferences
from ..core.base.errors import SeipError
from ..core.sensing.lidar.catalogue import load_catalogue
from ..core.sensing.lidar.model import LidarModel
from ..core.site.candidates import DEFAULT_TYPE
from ..scene import contract
from ..scene.sensors import labelled_sensors
from . import scene_status
from .session import session

PAPER = "generic"
"""Manufacturer of the types of the SEIP paper, which are models, not products."""


def title(model: LidarModel) -> str:
    """Return manufacturer and product; of the paper's types, the name alone."""
    return model.name if model.manufacturer == PAPER else f"{model.manufacturer} {model.name}"


def in_order() -> list[str]:
    """Return the keys of all types by manufacturer and product, the paper's last."""
    types = session.sensor_types
    return sorted(types, key=lambda key: (types[key].manufacturer == PAPER, title(types[key]).casefold()))


def refresh() -> None:
    """Read the catalogues again and list new types in all scenes; if a file is invalid the shipped types stay."""
    session.sensor_types.clear()
    session.catalogue_error = ""
    try:
        session.sensor_types.update(preferences.catalogue())
    except SeipError as error:
        session.sensor_types.update(load_catalogue())
        session.catalogue_error = str(error)
    for scene in bpy.data.scenes:
        if scene.library is None:
            list_types(scene)


def list_types(scene: bpy.types.Scene) -> None:
    """Add to a scene's list the types that it lacks, and drop those that are neither known nor used.

    In a list that was empty, the default type is used.
    """
    types = scene.seip.survey.types
    is_new = not len(types)
    for number in reversed(range(len(types))):
        if types[number].name not in session.sensor_types and not types[number].use:
            types.remove(number)
    for key in session.sensor_types:
        if key not in types:
            one = types.add()
            one.name = key
            one.use = is_new and key == DEFAULT_TYPE


def _after_load(*_: object) -> None:
    """List the types, and take over placements of commands; without a record use the types of the sensors."""
    refresh()
    for scene in bpy.data.scenes:
        if scene.library is None:
            scene.seip.take_over_placement()
        if scene.library is None and scene_status.has_unevaluated(scene):
            there = {obj.get(contract.SENSOR) for obj in labelled_sensors(scene, hidden=True).values()}
            if not there & set(scene.seip.survey.used_types()):
                for one in scene.seip.survey.types:
                    one.use = one.name in there


HANDLERS = (("load_post", _after_load),)
AT_START = (_after_load,)
