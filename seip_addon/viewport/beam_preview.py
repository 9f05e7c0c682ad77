"""A sensor's beams in the viewport: rings on a flat road, and the edges of the vertical field of view."""

import math
from dataclasses import dataclass
from functools import lru_cache

import bpy
import numpy as np

from ..core.base.arrays import Float
from ..core.output.pictures.palette import DENSE_BEAMS, PAPER, WIDE_BEAMS, rgb
from ..core.sensing.lidar.model import LidarModel
from ..core.sensing.lidar.rings import BeamRings, beam_rings
from ..core.sensing.visibility.ring_resolution import unresolved_from
from ..scene import contract
from ..state.overlay import Block, Entry, Layer, Overlay
from ..state.session import session

NAME = "beams"
DENSE, WIDE, CONE = (*rgb(DENSE_BEAMS), 0.9), (*rgb(WIDE_BEAMS), 0.9), (*rgb(PAPER), 0.35)
"""Colours of rings within 2δ of the next, of others, and of the edges of the field of view."""
WIDTH = 1.5  # pixels at the interface's usual scale
UPRIGHT = 1e-5  # radians
LIFT = 0.05  # metres of the rings above the road


@dataclass(frozen=True)
class Preview:
    """Sensor whose beams are shown.

    Parameters
    ----------
    matrix : tuple of 16 float
        From the sensor's axes to the scene's, row by row; the optical centre in metres.
    height : float, metres
        Above the road.
    delta : float, metres
    """

    model: LidarModel
    matrix: tuple[float, ...]
    height: float
    delta: float

    def lines(self) -> BeamRings:
        """Return the lines to be drawn."""
        matrix = np.array(self.matrix).reshape(4, 4)
        place, axes = matrix[:3, 3], self.axes
        ground = float(place[2]) - self.height + LIFT
        return beam_rings(self.model, place, axes, ground, 2 * self.delta)

    @property
    def axes(self) -> Float:
        """The sensor's axes as columns, (3, 3)."""
        rotation = np.array(self.matrix).reshape(4, 4)[:3, :3]
        axes: Float = rotation / np.maximum(np.linalg.norm(rotation, axis=0), 1e-9)
        return axes

    def resolved_to(self) -> float:
        """Return the radius, metres, to which all rings before the sensor are within 2δ of each other."""
        across = math.sqrt(max(self.model.max_range**2 - self.height**2, 0.0))
        return unresolved_from(self.model, self.height, self.delta, across, self.tilt)

    @property
    def tilt(self) -> float:
        """Angle by which azimuth zero points down, radians; 0 where single precision cannot tell it from 0."""
        tilt = math.asin(max(-1.0, min(1.0, -float(self.axes[2, 0]))))
        return tilt if abs(tilt) > UPRIGHT else 0.0


def preview_of(context: bpy.types.Context) -> Preview | None:
    """Return whose beams to show: the active sensor's, else the active type's at the 3D cursor; None if unknown."""
    scene, active = context.scene, context.object
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
    return Preview(model, tuple(matrix.ravel().tolist()), height, float(survey.delta))


def beam_overlay() -> Overlay:
    """Return the beams of the sensor that is active when the view is drawn."""
    return Overlay((), _legend, moving=_layers)


def _layers() -> tuple[Layer, ...]:
    preview = preview_of(bpy.context)
    return () if preview is None else _layers_of(preview)


@lru_cache(maxsize=1)  # until the sensor, its pose or δ changes
def _layers_of(preview: Preview) -> tuple[Layer, ...]:
    lines = preview.lines()
    pieces = ((lines.cone, CONE), (lines.rings[lines.wide], WIDE), (lines.rings[~lines.wide], DENSE))
    return tuple(
        Layer("LINES", piece.reshape(-1, 3).astype(np.float32), colour, WIDTH) for piece, colour in pieces if len(piece)
    )


def _legend(_scene: bpy.types.Scene) -> Block | None:
    """Return what the colours of the rings mean, and how far the road has no gaps."""
    preview = preview_of(bpy.context)
    if preview is None:
        return None
    where = f"in front up to {preview.resolved_to():.0f} m" if preview.tilt else f"up to {preview.resolved_to():.0f} m"
    return Block(
        f"{preview.model.name} at {preview.height:.3g} m: no gaps on a level road {where}",
        (
            Entry(f"at most {2 * preview.delta:.3g} m to the next ring inwards", (DENSE,)),
            Entry("more: road between may go unseen", (WIDE,)),
            Entry("edge of the field of view", (CONE,)),
        ),
    )
