"""Camera position that frames a set of points, and their pixel coordinates."""

import math
from dataclasses import dataclass

import numpy as np

from ...arrays import Float


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """A perspective camera.

    Parameters
    ----------
    place : (3,) float64, metres
    axes : (3, 3) float64
        Right, up and backwards as columns, orthonormal.
    slopes : (2,) float64
        Tangents of half the field of view, across and upwards.
    """

    place: Float
    axes: Float
    slopes: Float

    def project(self, points: Float) -> Float:
        """Return where points are on the picture, in shares of its width and height from the lower left.

        Parameters
        ----------
        points : (n, 3) float64, metres
            In front of the camera.

        Returns
        -------
        (n, 2) float64
        """
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
    slopes : (2,) float64
        Tangents of half the field of view, across and upwards.
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
