r"""Pose errors: normally distributed position, height, yaw and tilt.

A sensor planned at p with the yaw ψ and the tilt θ is mounted at p + e with the orientation

.. math::
    R = R_z(ψ + δ_ψ)\, R_y(θ + δ_θ)\, R_x(δ_φ), \qquad
    e_x, e_y \sim N(0, σ_p^2),\; e_z \sim N(0, σ_h^2),\;
    δ_ψ \sim N(0, σ_ψ^2),\; δ_θ, δ_φ \sim N(0, σ_t^2),

All errors are independent of each other and between posts. The rotations are yaw first, then pitch about the new y axis
(nose down is positive), then roll about the new x axis.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from ...base.arrays import Float
from ...base.errors import SeipError
from ...base.settings import setting
from ...site.obstruction import inside_any
from ...site.scene_geometry import Mesh

MAX_OFFSET_STD, MAX_ANGLE_STD = 100.0, 1.0  # metres and radians; larger standard deviations are taken for typing errors
_MICROMETRE = 1e-6
_KINDS_DRAWN = 6  # x, y, z, yaw, pitch, roll


@dataclass(frozen=True)
class PoseErrors:
    """Standard deviations of the errors of a sensor's pose.

    Parameters
    ----------
    position : float, metres
        Standard deviation of x and of y.
    height : float, metres
        Standard deviation of the height.
    yaw : float, radians
        Standard deviation of the yaw.
    tilt : float, radians
        Standard deviation of pitch and of roll.

    Raises
    ------
    SeipError
        A standard deviation is negative or too large.
    """

    position: float = setting(0.3, "standard deviation of x and of y", unit="m", maximum=MAX_OFFSET_STD)
    height: float = setting(0.3, "standard deviation of the height", unit="m", maximum=MAX_OFFSET_STD)
    yaw: float = setting(math.radians(2.0), "standard deviation of the yaw", unit="rad", maximum=math.pi)
    tilt: float = setting(
        math.radians(2.0),
        "standard deviation of pitch and of roll",
        unit="rad",
        maximum=MAX_ANGLE_STD,
    )

    def __post_init__(self) -> None:
        for name in ("position", "height"):
            value = getattr(self, name)
            if not 0 <= value <= MAX_OFFSET_STD:
                raise SeipError(f"the error of {name} must be 0 to {MAX_OFFSET_STD:g} m, not {value:g} m")
        for name, most in (("tilt", MAX_ANGLE_STD), ("yaw", math.pi)):
            value = getattr(self, name)
            if not 0 <= value <= most:
                limit, shown = math.degrees(most), math.degrees(value)
                raise SeipError(f"the error of {name} must be 0 to {limit:.0f}°, not {shown:g}°")

    def alone(self, kind: str) -> PoseErrors:
        """Return the errors of one kind, all others zero."""
        return replace(self, **{name: 0.0 for name in ERROR_KINDS if name != kind})


ERROR_KINDS = tuple(field.name for field in fields(PoseErrors))


def draw_errors(errors: PoseErrors, foot: Float, draws: int, seed: int) -> Float:
    """Draw random pose errors of sensors.

    The errors of a sensor depend only on the seed, the number of the draw and the sensor's position. They do not depend
    on its type and height, on other sensors, or on the number of draws. Errors with other standard deviations are the
    same draws, scaled.

    Parameters
    ----------
    foot : (s, 3) float64, metres
        Ground point of each sensor's position; equal ones have equal errors.
    draws, seed : int
        Number of draws, at least 1, and a seed of at least 0; see `Scenarios`.

    Returns
    -------
    (draws, s, 6) float64
        Errors of x, y and z in metres, and of yaw, pitch and roll in radians.
    """
    positions, of_position = np.unique(np.rint(foot / _MICROMETRE).astype(np.int64), axis=0, return_inverse=True)
    standard = np.stack([_standard_normal(seed, position, draws) for position in positions.tolist()], axis=1)
    scale = [errors.position, errors.position, errors.height, errors.yaw, errors.tilt, errors.tilt]
    drawn: Float = standard[:, of_position.ravel()] * np.array(scale)
    return drawn


def _standard_normal(seed: int, position: Sequence[int], draws: int) -> Float:
    """Return one position's draws, (draws, 6): a larger number of draws begins with the same ones."""
    signs = sum((coordinate < 0) << bit for bit, coordinate in enumerate(position))
    words = [seed, signs, *(abs(coordinate) for coordinate in position)]
    return np.random.default_rng(words).standard_normal((draws, _KINDS_DRAWN))


def out_of_objects(drawn: Float, xyz: Float, objects: Sequence[Mesh]) -> Float:
    """Move sensors that a draw puts inside an object to the opposite side, or, if that fails, to the planned position.

    Parameters
    ----------
    drawn : (n, s, 6) float64
        Errors; see `draw_errors`.
    xyz : (s, 3) float64, metres
        Planned positions.
    """
    drawn = drawn.copy()
    shift = drawn[..., :3]
    for factor in (-1.0, 0.0):
        inside = inside_any((xyz + shift).reshape(-1, 3), objects).reshape(shift.shape[:-1])
        shift[inside] *= factor
    return drawn
