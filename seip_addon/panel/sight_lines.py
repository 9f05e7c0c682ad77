"""Sight lines of one sensor, and the road in its range that it does not see."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ..core.base.arrays import Float
from ..core.base.errors import SeipError
from ..core.output.pictures.palette import HIDDEN_COLOUR, MISSED_COLOUR, SIGHT_LINE, rgb
from ..core.sensing.visibility.sight_lines import SightLines, pose_at, sight_lines
from ..scene import contract
from ..scene.sensors import pose_of
from ..scene.write import LIFT
from . import overlays
from .layout import draw_reason, draw_run
from .legend import Block, Colour, Entry
from .overlays import Layer, Overlay
from .scene_status import active_sensor, no_placement
from .session import session
from .survey import with_placement
from .work import ForPlacement, Job, LongWork

NAME = "sight lines"
LINES: Colour = (*rgb(SIGHT_LINE), 0.30)
HIDDEN: Colour = (*rgb(HIDDEN_COLOUR), 0.80)
MISSED: Colour = (*rgb(MISSED_COLOUR), 0.80)
ABOVE = LIFT + 0.02  # metres of the squares over the road: on the coverage, not in it


def sight_overlay(sight: SightLines, label: str) -> Overlay:
    """Return the lines from a sensor to the targets that it sees, and squares on those that it does not."""
    ends = sight.ends + np.array((0.0, 0.0, ABOVE))
    lines = np.stack([np.broadcast_to(sight.eye, ends.shape), ends], axis=1).reshape(-1, 3)
    layers = (
        Layer("TRIS", _faces(sight.hidden), HIDDEN),
        Layer("TRIS", _faces(sight.missed), MISSED),
        Layer("LINES", lines.astype(np.float32), LINES),
    )
    drawn = "" if len(sight.ends) == sight.seen else f", {len(sight.ends):,} of them drawn"
    block = Block(
        f"{label}: {sight.in_range:,} targets in its range",
        (
            Entry(f"{sight.seen:,} seen{drawn}", (_opaque(LINES),)),
            Entry(f"{len(sight.hidden):,} hidden by something", (_opaque(HIDDEN),)),
            Entry(f"{len(sight.missed):,} in view, but between beams or too faint", (_opaque(MISSED),)),
        ),
    )
    return Overlay(layers, lambda _scene: block)


def _faces(squares: Float) -> NDArray[np.float32]:
    """Return the two triangles of each square, (6 m, 3), above the road."""
    corners = (squares + np.array((0.0, 0.0, ABOVE))).astype(np.float32)
    faces: NDArray[np.float32] = corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    return faces


def _opaque(colour: Colour) -> Colour:
    return (*colour[:3], 1.0)


class SEIP_OT_show_sight_lines(ForPlacement, LongWork, bpy.types.Operator):
    """Draw lines from the sensor that is active in the list to the targets that it sees, and squares on those in its range that it does not see"""  # noqa: E501  # a tooltip is one line

    bl_options = {"REGISTER"}  # nothing in the file changes

    def job(self, scene: bpy.types.Scene) -> Job:
        """Restore the placement, and draw them."""
        scene, state = yield with_placement(scene)
        session.of(scene).state = state
        obj, label = active_sensor(scene), scene.seip.result.active_label()
        survey, _ = state.placed()
        key = str(obj.get(contract.SENSOR))
        pose = pose_at(survey.site.candidates, key, *pose_of(obj))
        if pose is None:
            raise SeipError(f"{label} is not at a candidate pose: move it back, or place again")
        settings = survey.settings
        row = survey.grid.sees(pose)
        sight = sight_lines(survey.site, pose, survey.models[key], row, settings.visibility.delta, settings.engine)
        overlays.show(scene, NAME, sight_overlay(sight, label))


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the button that shows the sight lines of the active sensor."""
    column = layout.column(align=True)
    column.label(text="Sight Lines")
    label = context.scene.seip.result.active_label() or "Sensor"
    draw_run(column, "seip.show_sight_lines", icon="LIGHT_SPOT", text=f"From {label}")
    if overlays.find(context.scene, NAME) is not None:
        column.operator("seip.hide_overlay", icon="X").name = NAME
    draw_reason(column, no_placement(context.scene))
