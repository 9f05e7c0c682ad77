"""A sensor's beams in the viewport: rings on a flat road, and the edges of the vertical field of view."""

import math
from dataclasses import dataclass

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ..core.arrays import Float
from ..core.output.pictures.palette import DENSE_BEAMS, PAPER, WIDE_BEAMS, rgb
from ..core.sensing.lidar.model import LidarModel
from ..core.sensing.lidar.rings import BeamRings, beam_rings
from ..core.sensing.visibility.ring_resolution import unresolved_from
from ..scene import contract
from ..session import session
from .overlays import redraw

DENSE, WIDE, CONE = (*rgb(DENSE_BEAMS), 0.9), (*rgb(WIDE_BEAMS), 0.9), (*rgb(PAPER), 0.35)
"""Colours of rings within 2δ of the next, of others, and of the edges of the field of view."""
WIDTH = 1.5  # pixels
UPRIGHT = 1e-5  # radians
LIFT = 0.05  # metres of the rings above the road


@dataclass(frozen=True, eq=False)
class Preview:
    """Sensor whose beams are shown.

    Parameters
    ----------
    place : (3,) float64, metres
        Optical centre.
    axes : (3, 3) float64
        Columns are the sensor's axes.
    height : float, metres
        Above the road.
    delta : float, metres
    """

    model: LidarModel
    place: Float
    axes: Float
    height: float
    delta: float

    def lines(self) -> BeamRings:
        """Return the lines to be drawn."""
        ground = float(self.place[2]) - self.height + LIFT
        return beam_rings(self.model, self.place, self.axes, ground, 2 * self.delta, self.resolved_to())

    def resolved_to(self) -> float:
        """Return the radius, metres, to which all rings before the sensor are within 2δ of each other.

        Of a rosette: to which all road in view has a ray of the frame within δ.
        """
        return unresolved_from(self.model, self.height, self.delta, self.range_on_road(), self.tilt)

    @property
    def tilt(self) -> float:
        """How far azimuth zero is turned down, radians: zero where that is what single precision makes of it."""
        tilt = math.asin(max(-1.0, min(1.0, -float(self.axes[2, 0]))))
        return tilt if abs(tilt) > UPRIGHT else 0.0

    def range_on_road(self) -> float:
        """Return the radius, metres, at which the range ends on the road."""
        return math.sqrt(max(self.model.max_range**2 - self.height**2, 0.0))


class _Overlay:
    """The draw handler, and the batches for what was drawn last."""

    handle: object | None = None
    drawn: tuple[object, ...] = ()
    batches: tuple[gpu.types.GPUBatch, ...] = ()


def is_shown() -> bool:
    """Return whether beams are shown."""
    return _Overlay.handle is not None


def show() -> None:
    """Show beams in all 3D views until `hide`."""
    if _Overlay.handle is None:
        _Overlay.handle = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")
    redraw()


def hide() -> None:
    """Show none."""
    if _Overlay.handle is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_Overlay.handle, "WINDOW")
    _Overlay.handle, _Overlay.drawn, _Overlay.batches = None, (), ()
    redraw()


def preview_of(context: bpy.types.Context) -> Preview | None:
    """Return whose beams to show: the active sensor's, else the active type's at the 3D cursor; None if unknown."""
    scene = context.scene
    survey = scene.seip.survey
    active = context.object
    if active is not None and active.get(contract.SENSOR) in session.sensor_types:
        matrix = np.array(active.matrix_world, dtype=np.float64)
        axes = matrix[:3, :3] / np.maximum(np.linalg.norm(matrix[:3, :3], axis=0), 1e-9)
        height = active.get("seip_height", survey.preview_height)
        return Preview(
            session.sensor_types[active[contract.SENSOR]], matrix[:3, 3], axes, float(height), float(survey.delta)
        )
    model = session.sensor_types.get(survey.shown_type())
    if model is None:
        return None
    place = np.add(scene.cursor.location, (0.0, 0.0, survey.preview_height))
    return Preview(model, place, np.eye(3), float(survey.preview_height), float(survey.delta))


def _draw() -> None:
    preview = preview_of(bpy.context)
    if preview is None:
        return
    shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    state = (id(preview.model), preview.place.tobytes(), preview.axes.tobytes(), preview.height, preview.delta)
    if state != _Overlay.drawn:
        lines = preview.lines()
        _Overlay.batches = tuple(
            batch_for_shader(shader, "LINES", {"pos": piece.reshape(-1, 3).astype(np.float32)})
            for piece in (lines.cone, lines.rings[lines.wide], lines.rings[~lines.wide])
        )
        _Overlay.drawn = state
    before = gpu.state.blend_get(), gpu.state.depth_test_get()
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_test_set("LESS_EQUAL")
    _, _, width, height = gpu.state.viewport_get()
    shader.bind()
    shader.uniform_float("viewportSize", (width, height))
    shader.uniform_float("lineWidth", WIDTH)
    for batch, colour in zip(_Overlay.batches, (CONE, WIDE, DENSE), strict=True):
        shader.uniform_float("color", colour)
        batch.draw(shader)
    gpu.state.blend_set(before[0])
    gpu.state.depth_test_set(before[1])


def forget() -> None:
    """Leave nothing in the viewport: another file is opened, or the add-on is disabled."""
    if is_shown():
        hide()
