"""Camera of the rendered picture, and what it shows where: all that the Blender that renders needs of pictures."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...base.arrays import Boolean, Float


@dataclass(frozen=True, eq=False)
class Sight:
    """Positions on a picture, as shares of its width and height from the lower left.

    ``sensors`` (k, 2), of which those in ``hidden`` (k,) have something before them, and ``targets`` (t, 2).
    """

    sensors: Float
    hidden: Boolean
    targets: Float


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """A perspective camera at a place (3,), metres.

    The columns of ``axes`` (3, 3) are right, up and backwards, orthonormal; ``slopes`` (2,) are the tangents of half
    the field of view, across and upwards.
    """

    place: Float
    axes: Float
    slopes: Float

    def project(self, points: Float) -> Float:
        """Return the positions of points (n, 3) on the picture, (n, 2) in shares of its size from the lower left."""
        seen = (points - self.place) @ self.axes
        return 0.5 + seen[:, :2] / (-2.0 * seen[:, 2:] * self.slopes)


def frame(points: Float, azimuth: float, elevation: float, slopes: Float) -> Viewpoint:
    r"""Return the nearest viewpoint in a direction that has all points in its picture.

    With right, up and backwards coordinates :math:`r, u, b` of a point and :math:`c_r, c_u, c_b` of the camera, the
    point is in the picture when :math:`|r - c_r| \le s_r (c_b - b)` and the same for :math:`u`. The largest :math:`r +
    s_r b` and :math:`-r + s_r b` over all points therefore give :math:`c_r` and the least :math:`c_b` directly; the
    larger of the two :math:`c_b` is taken.

    Parameters
    ----------
    points : (n, 3) float64, metres
    azimuth, elevation : float, radians
        Direction from the points to the camera; azimuth counter-clockwise from +x.
    """
    level, rise = math.cos(elevation), math.sin(elevation)
    back = np.array((level * math.cos(azimuth), level * math.sin(azimuth), rise))
    right = np.array((-math.sin(azimuth), math.cos(azimuth), 0.0))
    axes = np.column_stack((right, np.cross(back, right), back))
    seen = points @ axes
    high = (seen[:, :2] + slopes * seen[:, 2:]).max(axis=0)
    low = (-seen[:, :2] + slopes * seen[:, 2:]).max(axis=0)
    place = axes @ np.append((high - low) / 2.0, ((high + low) / (2.0 * slopes)).max())
    return Viewpoint(place, axes, slopes)
