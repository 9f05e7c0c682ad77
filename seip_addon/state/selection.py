"""Selection of objects from list rows, and of rows from objects."""

from collections.abc import Iterator

import bpy

from ..scene import contract
from ..scene.sensors import placed_sensors
from .session import session


def select_sensor(result: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """Select the sensor that was clicked on in the list, and nothing else."""
    empty = placed_sensors(context.scene).get(result.sensors[result.active_sensor].name)
    if empty is None or empty.name not in context.view_layer.objects:
        return
    select_alone(context, empty)


def select_alone(context: bpy.types.Context, obj: bpy.types.Object) -> None:
    """Select an object, and nothing else, and make it active."""
    for other in context.selected_objects:
        other.select_set(state=False)
    obj.select_set(state=True)
    context.view_layer.objects.active = obj


def search_positions(_goal: bpy.types.PropertyGroup, context: bpy.types.Context, text: str) -> Iterator[str]:
    """Yield the names of positions that hold a text: those that were laid out, or else the poles."""
    scene = context.scene
    state = session.of(scene).state
    if state is not None:
        names = state.layout.site.candidates.position_name.tolist()
    else:
        names = sorted(obj.name for obj in contract.members(scene)[contract.POLES])
    yield from (name for name in names if text.lower() in name.lower())


def position_of(scene: bpy.types.Scene, obj: bpy.types.Object | None) -> str:
    """Return the name of the position that an object stands for: a sensor's, or a pole's own; empty if for none."""
    while obj is not None:
        if contract.POSITION in obj:
            return str(obj[contract.POSITION])
        if obj in contract.members(scene)[contract.POLES]:
            return str(obj.name)
        obj = obj.parent
    return ""
