"""The rings that a LiDAR's beams draw on a flat road, and the edges of its field of view."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.arrays import Boolean, Float
from .beams import BeamPattern
from .model import LidarModel

RING_AZIMUTHS = 120


@dataclass(frozen=True, eq=False)
class BeamRings:
    """Rings and edges of the field of view, as lines.

    Parameters
    ----------
    rings : (n, 2, 3) float64, metres
        Segments of the rings on the road.
    wide : (n,) bool
        Whether the distance to the next inner ring is larger than the given gap, so that a target may lie between the
        two.
    cone : (m, 2, 3) float64, metres
        Beams of the lowest and the highest channel, from the sensor to the road or to the end of its range, at a few
        azimuths; the first and the last are the borders of a limited field of view.
    """

    rings: Float
    wide: Boolean
    cone: Float


def beam_rings(model: LidarModel, place: Float, axes: Float, ground: float, gap: float) -> BeamRings:
    """Return the rings of a sensor on a flat road, and the edges of its field of view.

    Parameters
    ----------
    place : (3,) float64, metres
        Optical centre.
    axes : (3, 3) float64
        The sensor's x, y and z axis as columns.
    ground : float, metres
        Height of the road.
    gap : float, metres
        Largest distance between rings that leaves no gap: twice δ.
    """
    beams = _directions(model) @ axes.T
    hits, meets = _on_road(model, place, beams, ground)
    inwards = np.full(meets.shape, np.inf)  # to the next ring, along each azimuth
    inwards[1:] = np.linalg.norm(hits[1:, :, :2] - hits[:-1, :, :2], axis=-1)
    inwards[1:][~meets[:-1]] = 0.0
    inwards[0] = 0.0
    drawn = meets[:, :-1] & meets[:, 1:]
    rings = np.stack([hits[:, :-1], hits[:, 1:]], axis=2)[drawn]
    ends = np.where(meets[..., None], hits, place + model.max_range * beams)
    across = np.arange(0, RING_AZIMUTHS if model.all_round else RING_AZIMUTHS + 1, RING_AZIMUTHS // 12)
    edges = ends[[0, -1]][:, across].reshape(-1, 3)
    cone = np.stack([np.broadcast_to(place, edges.shape), edges], axis=1)
    return BeamRings(rings, (np.maximum(inwards[:, :-1], inwards[:, 1:]) > gap)[drawn], cone)


def _on_road(model: LidarModel, place: Float, beams: Float, ground: float) -> tuple[Float, Boolean]:
    """Return the points where beams (…, 3) meet a flat road, and whether each is within the sensor's range."""
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (ground - place[2]) / beams[..., 2]
    meets = (reach > model.min_range) & (reach <= model.max_range)
    return place + np.where(meets, reach, 0.0)[..., None] * beams, meets


def _directions(model: LidarModel) -> Float:
    """Return unit directions (channels, `RING_AZIMUTHS` + 1, 3) in the sensor's axes, the lowest channel first.

    If the model rotates, the last azimuth equals the first.
    """
    span = model.azimuth_count if model.all_round else model.azimuth_count - 1
    steps = np.arange(RING_AZIMUTHS + 1) * span // RING_AZIMUTHS % model.azimuth_count
    channels = np.argsort(model.elevations, kind="stable")
    rays = channels[:, None] * model.azimuth_count + steps
    return BeamPattern(model).directions(rays.ravel()).reshape(model.channels, RING_AZIMUTHS + 1, 3)
