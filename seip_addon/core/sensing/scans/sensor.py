"""A mounted sensor: LiDAR model, position and orientation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.arrays import Float
from ...base.errors import SeipError
from ..lidar.model import LidarModel

_ORTHONORMAL_TOLERANCE = 1e-6
"""Largest deviation of an orientation's columns from orthonormal vectors."""


@dataclass(frozen=True, eq=False)
class MountedSensor:
    """A LiDAR model at a position and orientation.

    Parameters
    ----------
    label : str
        Label, as ``S1``.
    xyz : (3,) float64, metres
        Optical centre, local site axes.
    orientation : (3, 3) float64
        Rotation from the sensor's axes (x along azimuth zero, z up along its axis) to the site's.

    Examples
    --------
    >>> from seip_addon.core.sensing.lidar.catalogue import load_catalogue
    >>> facing_north = level_orientation(np.pi / 2)
    >>> sensor = MountedSensor("S1", load_catalogue()["vlp16"], np.array([4.0, 0.0, 5.0]), facing_north)
    >>> (sensor.xyz + sensor.orientation @ [10.0, 0.0, 0.0]).round(6).tolist()
    [4.0, 10.0, 5.0]
    """

    label: str
    model: LidarModel
    xyz: Float
    orientation: Float

    def __post_init__(self) -> None:
        axes = self.orientation
        rigid = np.allclose(axes.T @ axes, np.eye(3), rtol=0, atol=_ORTHONORMAL_TOLERANCE) and np.linalg.det(axes) > 0
        if not (rigid and np.isfinite(self.xyz).all()):
            raise SeipError(
                f"sensor {self.label!r} has an invalid position, or is mirrored or skewed: reset its transform"
            )


def level_orientation(yaw: float) -> Float:
    """Return the orientation of an upright sensor whose azimuth zero points along ``yaw`` (radians)."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
