"""The site: targets, candidate poses and the static triangles between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

Float = NDArray[np.float64]
Integer = NDArray[np.int64]
Boolean = NDArray[np.bool_]
Text = NDArray[np.str_]


@dataclass(frozen=True, eq=False)
class Candidates:
    """Where a sensor may hang: positions (in plan), and poses (position × height × sensor type).

    Parameters
    ----------
    position : (p, 3) float64, metres
        Ground point of each position, local site axes.
    position_name : (p,) str
        Name of the pole, or ``sidewalk 12``.
    on_pole : (p,) bool
        Whether the position is an existing pole.
    position_of : (c,) int64
        Position of each pose.
    sensor : (c,) str
        Catalogue key of each pose's sensor type.
    height : (c,) float64, metres
        Height of the sensor above the ground point.
    xyz : (c, 3) float64, metres
        Optical centre. On a pole it stands off the shaft by the bracket.
    yaw : (c,) float64, radians
        Direction of azimuth zero of the beam pattern, counter-clockwise from +x.
    mandatory : (g, p) bool
        Each row is a group of positions of which at least one must carry a sensor.
    mandatory_name : (g,) str
        Names of those groups.
    dropped : dict of str to int
        How many positions or poses were dropped, by reason.
    """

    position: Float
    position_name: Text
    on_pole: Boolean
    position_of: Integer
    sensor: Text
    height: Float
    xyz: Float
    yaw: Float
    mandatory: Boolean
    mandatory_name: Text
    dropped: dict[str, int]

    def __len__(self) -> int:
        """Return the number of poses."""
        return len(self.xyz)


@dataclass(frozen=True, eq=False)
class Targets:
    """The road points to be seen.

    Parameters
    ----------
    xyz : (t, 3) float64, metres
        On the road surface, local site axes.
    weight : (t,) float64
        Importance in the weighted problem, 1 outside every weighted region.
    central : (t,) bool
        Whether the target lies in some weighted region.
    spacing : float, metres
        Side of the square that each target stands for.
    """

    xyz: Float
    weight: Float
    central: Boolean
    spacing: float

    def __len__(self) -> int:
        """Return the number of targets."""
        return len(self.xyz)


@dataclass(frozen=True, eq=False)
class Site:
    """All that visibility and placement need of a place.

    Parameters
    ----------
    name : str
        Name of the scene.
    origin : (3,) float64, metres
        Map coordinates of the local origin: map = local + origin.
    region : shapely geometry
        Region of interest in plan, local.
    targets : Targets
    candidates : Candidates
    triangles : (n, 3, 3) float64, metres
        All static surfaces that a ray can end on, roads included.
    """

    name: str
    origin: Float
    region: BaseGeometry
    targets: Targets
    candidates: Candidates
    triangles: Float
