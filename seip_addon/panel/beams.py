"""A sensor's beams in the viewport: rings on a flat road, and the edges of the vertical field of view."""

from __future__ import annotations

import math
from functools import lru_cache

import bpy
import numpy as np

from ..core.output.pictures.palette import DENSE_BEAMS, PAPER, WIDE_BEAMS, rgb
from ..core.sensing.lidar.model import LidarModel
from ..core.sensing.lidar.rings import beam_rings
from ..core.sensing.visibility.ring_resolution import unresolved_from
from ..scene import contract
from . import overlays
from .layout import settings_column
from .legend import Block, Entry
from .overlays import Layer, Overlay
from .session import session
from .work import ShortWork

NAME = "beams"
DENSE, WIDE, CONE = (*rgb(DENSE_BEAMS), 0.9), (*rgb(WIDE_BEAMS), 0.9), (*rgb(PAPER), 0.35)
"""Colours of rings within 2δ of the next, of others, and of the edges of the field of view."""
WIDTH = 1.5  # pixels at the interface's usual scale
UPRIGHT = 1e-5  # radians
LIFT = 0.05  # metres of the rings above the road


Preview = tuple[LidarModel, tuple[float, ...], float, float]
"""Sensor whose beams are shown: model, the 16 entries of the matrix from its axes to the scene's, height above the road
in metres, and δ in metres."""
Beams = tuple[tuple[Layer, ...], Block]
"""Lines of the beams, and what their colours mean."""


def _preview() -> Preview | None:
    """Return whose beams to show: the active sensor's, else the active type's at the 3D cursor; None if unknown."""
    scene, active = bpy.context.scene, bpy.context.object
    survey = scene.seip.survey
    height = float(survey.preview_height)
    if active is not None and active.get(contract.SENSOR) in session.sensor_types:
        model = session.sensor_types[active[contract.SENSOR]]
        matrix, height = np.array(active.matrix_world), float(active.get("seip_height", height))
    elif survey.shown_type() in session.sensor_types:
        model, matrix = session.sensor_types[survey.shown_type()], np.eye(4)
        matrix[:3, 3] = np.add(scene.cursor.location, (0.0, 0.0, height))
    else:
        return None
    return model, tuple(matrix.ravel().tolist()), height, float(survey.delta)


@lru_cache(maxsize=1)  # until the sensor, its pose or δ changes
def _beams(
    model: LidarModel, matrix: tuple[float, ...], height: float, delta: float
) -> tuple[tuple[Layer, ...], Block]:
    """Return the beams of a sensor.

    Up to the radius in the legend all rings before the sensor are within 2δ of each other; of a rosette, all road in
    view has a ray of the frame within δ.
    """
    placed = np.array(matrix).reshape(4, 4)
    axes = placed[:3, :3] / np.maximum(np.linalg.norm(placed[:3, :3], axis=0), 1e-9)
    tilt = math.asin(max(-1.0, min(1.0, -float(axes[2, 0]))))
    tilt = tilt if abs(tilt) > UPRIGHT else 0.0  # single precision cannot tell it from 0
    across = math.sqrt(max(model.max_range**2 - height**2, 0.0))
    resolved = unresolved_from(model, height, delta, across, tilt)
    lines = beam_rings(model, placed[:3, 3], axes, float(placed[2, 3]) - height + LIFT, 2 * delta, resolved)
    pieces = ((lines.cone, CONE), (lines.rings[lines.wide], WIDE), (lines.rings[~lines.wide], DENSE))
    rosette = model.rosette is not None
    dense = f"at most {delta if rosette else 2 * delta:.3g} m to {'a ray' if rosette else 'the next ring inwards'}"
    where = f"{'in front ' if tilt else ''}up to {resolved:.0f} m"
    return tuple(
        Layer("LINES", piece.reshape(-1, 3).astype(np.float32), colour, WIDTH) for piece, colour in pieces if len(piece)
    ), Block(
        f"{model.name} at {height:.3g} m: no gaps on a level road {where}",
        (
            Entry(dense, (DENSE,)),
            Entry("more: road between may go unseen", (WIDE,)),
            Entry("edge of the field of view", (CONE,)),
        ),
    )


def beam_overlay() -> Overlay:
    """Return the beams of the sensor that is active when the view is drawn."""

    def legend(_scene: bpy.types.Scene) -> Block | None:
        preview = _preview()
        return None if preview is None else _beams(*preview)[1]

    def layers() -> tuple[Layer, ...]:
        preview = _preview()
        return () if preview is None else _beams(*preview)[0]

    return Overlay((), legend, moving=layers)


class SEIP_OT_preview_beams(ShortWork, bpy.types.Operator):
    """Show or hide the beams of the selected sensor, or else of the sensor shown in the sidebar at the 3D cursor: rings on a flat road and the edges of the vertical field of view"""  # noqa: E501  # a tooltip is one line

    def act(self, context: bpy.types.Context) -> None:
        """Show or hide them."""
        if overlays.find(context.scene, NAME):
            overlays.hide(context.scene, NAME)
        else:
            overlays.show(context.scene, NAME, beam_overlay())


def draw_beams(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw the button; the legend in the view says what the colours of the rings mean."""
    shown = overlays.find(context.scene, NAME) is not None
    settings_column(layout).prop(context.scene.seip.survey, "preview_height")
    text = "Hide Beams" if shown else "Show Beams"
    layout.operator("seip.preview_beams", text=text, icon="LIGHT_SPOT", depress=shown)
