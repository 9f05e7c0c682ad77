r"""Orientation of sensors: rotation from a sensor's axes (x along azimuth zero, z up) to those of the site.

A sensor of yaw ψ, tilt θ and roll φ is rotated as

.. math::
    R = R_z(ψ)\, R_y(θ)\, R_x(φ):

first about z, so that azimuth zero points to ψ, counter-clockwise from +x; then nose down by θ about the new y axis, so
that the ray of azimuth zero and elevation zero points θ below the horizon; then about the new x axis.
"""

import math

import numpy as np

from ..base.arrays import Float

VERTICAL_SINE = 1 - 1e-12  # sine of the tilt from which on azimuth zero counts as pointing straight down, or up
UNIT_TOLERANCE = 1e-3  # of rotations and quaternions in files, which have few digits


def orientations(yaw: Float, tilt: Float, roll: Float) -> Float:
    """Return rotations (..., 3, 3) float64 from the axes of sensors to those of the site.

    Parameters
    ----------
    yaw, tilt, roll : (...) float64, radians
        Angles in arrays of one shape. Positive tilts are nose down.
    """
    sin_yaw, cos_yaw = np.sin(yaw), np.cos(yaw)
    sin_tilt, cos_tilt = np.sin(tilt), np.cos(tilt)
    sin_roll, cos_roll = np.sin(roll), np.cos(roll)
    rows = [
        [
            cos_yaw * cos_tilt,
            cos_yaw * sin_tilt * sin_roll - sin_yaw * cos_roll,
            cos_yaw * sin_tilt * cos_roll + sin_yaw * sin_roll,
        ],
        [
            sin_yaw * cos_tilt,
            sin_yaw * sin_tilt * sin_roll + cos_yaw * cos_roll,
            sin_yaw * sin_tilt * cos_roll - cos_yaw * sin_roll,
        ],
        [-sin_tilt, cos_tilt * sin_roll, cos_tilt * cos_roll],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def orientation(yaw: float, tilt: float, roll: float = 0.0) -> Float:
    """Return the rotation of one sensor, (3, 3) float64; see `orientations`.

    Examples
    --------
    >>> north = orientation(yaw=math.radians(90.0), tilt=math.radians(10.0))
    >>> (north @ [1.0, 0.0, 0.0]).round(3).tolist()
    [0.0, 0.985, -0.174]
    >>> [round(math.degrees(angle), 6) for angle in angles_of(north)]
    [90.0, 10.0, 0.0]
    """
    return orientations(np.array(yaw), np.array(tilt), np.array(roll))


def angles_of(matrix: Float) -> tuple[float, float, float]:
    """Return yaw, tilt and roll (radians) of a rotation (3, 3) from a sensor's axes to those of the site."""
    tilt = math.atan2(-matrix[2, 0], math.hypot(matrix[0, 0], matrix[1, 0]))
    if abs(matrix[2, 0]) > VERTICAL_SINE:  # straight down or up: yaw and roll turn about one axis
        return math.atan2(-matrix[0, 1], matrix[1, 1]), tilt, 0.0
    return math.atan2(matrix[1, 0], matrix[0, 0]), tilt, math.atan2(matrix[2, 1], matrix[2, 2])


def rotations(yaw: Float, pitch: Float) -> Float:
    """Return rotations (n, 3, 3) from the axes of road users (forward, left, up) to those of the site.

    Parameters
    ----------
    yaw, pitch : (n,) float64, radians
        Yaw counter-clockwise from +x; positive pitches are nose up.
    """
    zero = np.zeros_like(yaw)
    forward = np.stack([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)], axis=-1)
    left = np.stack([-np.sin(yaw), np.cos(yaw), zero], axis=-1)
    return np.stack([forward, left, np.cross(forward, left)], axis=-1)


def rotated(vectors: Float, matrix: Float) -> Float:
    """Return the products of a matrix and each vector, (n, 3) float64.

    The result for a vector has the same bits in every batch, which a matrix product does not guarantee.

    Parameters
    ----------
    vectors : (n, 3) float64
    matrix : (3, 3) float64
    """
    x, y, z = vectors.T
    return np.stack([row[0] * x + row[1] * y + row[2] * z for row in matrix], axis=1)


def describe_turn(tilt: float, yaw: float | None = None) -> str:
    """Describe a sensor's tilt and yaw as text to append to a height; "" for an upright sensor.

    Parameters
    ----------
    tilt : float, radians
        Tilt of the sensor.
    yaw : float, radians, optional
        Yaw of a sensor that does not cover all azimuths.
    """
    tilted = f", tilted {np.degrees(tilt):.3g}°" if tilt else ""
    return tilted if yaw is None else f"{tilted}, yaw {np.degrees(yaw) % 360:.3g}°"


def quaternion_rotation(quaternion: Float) -> Float:
    """Return the rotation (3, 3) float64 of a quaternion w, x, y, z whose length is 1 within `UNIT_TOLERANCE`.

    Raises
    ------
    ValueError
        The length differs.
    """
    length = math.hypot(*quaternion.tolist())  # does not overflow, unlike the root of a sum of squares
    if not abs(length - 1.0) <= UNIT_TOLERANCE:
        raise ValueError("the quaternion does not have the length 1")
    w, *vector = (quaternion / length).tolist()
    x, y, z = vector
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: Float = np.eye(3) + 2.0 * (w * cross + cross @ cross)
    return turn


def quaternion_of(matrix: Float) -> Float:
    """Return the unit quaternion w, x, y, z, (4,) float64, of a rotation (3, 3)."""
    (sin_yaw, cos_yaw), (sin_tilt, cos_tilt), (sin_roll, cos_roll) = (
        (math.sin(angle / 2), math.cos(angle / 2)) for angle in angles_of(matrix)
    )
    return np.array(
        [
            cos_yaw * cos_tilt * cos_roll + sin_yaw * sin_tilt * sin_roll,
            cos_yaw * cos_tilt * sin_roll - sin_yaw * sin_tilt * cos_roll,
            cos_yaw * sin_tilt * cos_roll + sin_yaw * cos_tilt * sin_roll,
            sin_yaw * cos_tilt * cos_roll - cos_yaw * sin_tilt * sin_roll,
        ]
    )


def nearest_rotation(matrix: Float) -> Float:
    """Return the rotation (3, 3) float64 closest to a matrix that is a rotation within `UNIT_TOLERANCE`.

    Raises
    ------
    ValueError
        The matrix is mirrored, scaled or skewed.
    """
    if not np.allclose(matrix.T @ matrix, np.eye(3), rtol=0.0, atol=UNIT_TOLERANCE):
        raise ValueError("the rotation is scaled or skewed: its columns are not perpendicular vectors of length 1")
    if np.linalg.det(matrix) < 0.0:
        raise ValueError("the rotation is mirrored: its determinant is -1")
    left, _, right = np.linalg.svd(matrix)
    closest: Float = left @ right
    return closest


def degrees(heading: float) -> float:
    """Return a heading in degrees counter-clockwise, 0 <= degrees < 360."""
    return (round(math.degrees(heading), 6) + 0.0) % 360.0


def tilt_degrees(tilt: float) -> float:
    """Return a tilt in degrees, nose down positive, -90 < degrees < 90."""
    return round(math.degrees(tilt), 6) + 0.0
