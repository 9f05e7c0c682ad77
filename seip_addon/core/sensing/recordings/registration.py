"""Registration: the pose of a mounted sensor, found by fitting its background to a scene."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...base.arrays import Boolean, Float, Integer
from ...base.errors import SeipError
from ...base.estimates import student_quantile
from ...geometry.orientation import nearest_rotation
from ..scans.scanner import ReflectiveSurface
from ..scans.sensor import MountedSensor
from .background import Background

MATCH = 0.3
"""Metres from the scene's surface within which a measured point agrees with it."""

LEAST_MATCH = 0.5
"""Share of the rays that must agree; with fewer the recording is of another site, or the scene of another time."""

_RAYS = 20_000  # used: enough for millimetres, few enough for seconds
_STARTS = tuple(math.radians(angle) for angle in (0.0, -4.0, 4.0, -8.0, 8.0))  # yaw errors tried
_SCALES = (3.0, 3.0, 1.5, 1.5, 0.8, 0.8, 0.4, 0.4, 0.2, 0.2, 0.2, 0.2)  # metres: of the robust weight, by iteration
_MAX_FAR = 120.0  # metres: farther returns are few and fall at grazing angles
_SECTORS = 36  # of azimuth, which the interval treats as independent
_SYSTEMATIC = np.array([1e-4] * 3 + [1e-5] * 3)  # metres and radians: errors common to all rays, as of recovered rings


@dataclass(frozen=True, eq=False)
class Registration:
    """Pose of a sensor that fits its recording.

    Parameters
    ----------
    sensor : MountedSensor
        The sensor at the fitted pose.
    shift : (6,) float64
        Fitted less planned pose: x, y, z in metres, and the rotation vector in radians, about the site's axes.
    half_width : (6,) float64
        Half the width of the 95 % interval of each component of `shift`.
    match : float, 0 to 1
        Share of the rays that agree with the scene within `MATCH`.
    """

    sensor: MountedSensor
    shift: Float
    half_width: Float
    match: float


@dataclass(frozen=True, eq=False)
class _Fit:
    """Residuals (n,) of rays in metres, their derivatives (n, 6) and robust weights (n,)."""

    residual: Float
    derivative: Float
    weight: Float


def register(surface: ReflectiveSurface, planned: MountedSensor, background: Background) -> Registration:
    """Fit the pose of a sensor to its background.

    Point-to-plane registration in which each measured point is compared with the surface that its own ray meets, so
    that no nearest neighbours are needed (projective association; Blais and Levine 1995). Tukey's weight, narrowed from
    3 m to 0.2 m, leaves out what has changed. The fit starts from several yaws, because that is what installers get
    wrong most.

    The interval is that of the cluster-robust covariance with sectors of azimuth as clusters: neighbouring rays meet
    the same surface and share its errors. Errors common to all rays are added (0.1 mm and 0.01 mrad in simulated
    recordings); an offset of the sensor's ranges is not known and not included.

    Parameters
    ----------
    surface : ReflectiveSurface
        Static scene in site axes.
    planned : MountedSensor
        Planned pose, at most about a metre and ten degrees from the true one.

    Raises
    ------
    SeipError
        Too few rays agree with the scene.
    """
    ray, measured = _chosen(background)
    directions = background.rays.directions()[ray]
    found = []
    for yaw in _STARTS:
        xyz, orientation = planned.xyz.copy(), rotation_of(np.array([0.0, 0.0, yaw])) @ planned.orientation
        for scale in _SCALES:
            fit = _fit(surface, xyz, directions @ orientation.T, measured, scale, planned.model.max_range)
            step = _solved(fit)
            xyz, orientation = xyz + step[:3], rotation_of(step[3:]) @ orientation
        fit = _fit(surface, xyz, directions @ orientation.T, measured, _SCALES[-1], planned.model.max_range)
        found.append((float((np.abs(fit.residual) < MATCH).mean()), xyz, orientation, fit))
    match, xyz, orientation, fit = max(found, key=lambda one: one[0])
    if match < LEAST_MATCH:
        raise SeipError(
            f"only {match:.0%} of the rays of {planned.label} agree with the scene: this is the recording of another "
            "site or sensor, or the planned pose is more than a metre or ten degrees off"
        )
    rotation = orientation @ planned.orientation.T
    covariance = _covariance(fit, sector_of(directions, _SECTORS))
    return Registration(
        sensor=MountedSensor(planned.label, planned.model, xyz, nearest_rotation(orientation)),
        shift=np.concatenate([xyz - planned.xyz, rotation_vector(rotation)]),
        half_width=np.hypot(student_quantile(_SECTORS - 1) * np.sqrt(np.diag(covariance)), _SYSTEMATIC),
        match=match,
    )


def _chosen(background: Background) -> tuple[Integer, Float]:
    """Return evenly chosen rays with a background, and their ranges."""
    known = np.flatnonzero(np.isfinite(background.usual) & (background.usual < _MAX_FAR))
    if len(known) < 1000:
        raise SeipError(f"only {len(known)} rays have a background: the pose cannot be fitted")
    known = known[:: max(1, len(known) // _RAYS)]
    return known, background.usual[known].astype(np.float64)


def _fit(
    surface: ReflectiveSurface, xyz: Float, directions: Float, measured: Float, scale: float, reach: float
) -> _Fit:
    """Return the distances of measured points from the planes that their rays meet, and the derivatives by the pose."""
    predicted, triangle = surface.caster.cast(xyz, directions, reach)
    hit = triangle >= 0
    normal = np.where(hit[:, None], surface.normals[triangle], 0.0)
    along = np.where(hit, measured - np.where(hit, predicted, 0.0), np.inf)
    with np.errstate(invalid="ignore"):
        residual = np.where(hit, along * np.einsum("ni,ni->n", normal, directions), np.inf)
    # A small motion (t, w) moves the point p to p + t + w x r, with r from the sensor to the point.
    derivative = np.concatenate([normal, np.cross(measured[:, None] * directions, normal)], axis=1)
    inside = np.abs(residual) < scale
    weight = np.where(inside, (1 - (np.where(inside, residual, 0.0) / scale) ** 2) ** 2, 0.0)
    return _Fit(residual, derivative, weight)


def _solved(fit: _Fit) -> Float:
    """Return the Gauss-Newton step (6,): translation and rotation vector."""
    used = fit.weight > 0
    weighted = fit.derivative[used] * fit.weight[used, None]
    step, *_ = np.linalg.lstsq(weighted.T @ fit.derivative[used], -weighted.T @ fit.residual[used], rcond=1e-9)
    return np.asarray(step)


def _covariance(fit: _Fit, sector: Integer) -> Float:
    """Return the cluster-robust covariance (6, 6) of the fitted pose (Liang and Zeger 1986)."""
    used: Boolean = fit.weight > 0
    weighted = fit.derivative[used] * fit.weight[used, None]
    bread = np.linalg.pinv(weighted.T @ fit.derivative[used])
    scores = np.zeros((_SECTORS, 6))
    np.add.at(scores, sector[used], weighted * fit.residual[used, None])
    clusters = len(np.unique(sector[used]))
    covariance: Float = bread @ (scores.T @ scores) @ bread * clusters / max(clusters - 1, 1)
    return covariance


def sector_of(directions: Float, sectors: int) -> Integer:
    """Return the sector of azimuth of each direction (n, 3), (n,) int64 from 0 to ``sectors`` - 1.

    Intervals treat sectors as independent: neighbouring rays meet the same surfaces.
    """
    azimuth = np.arctan2(directions[:, 1], directions[:, 0])
    sector: Integer = np.floor((azimuth + math.pi) / math.tau * sectors).astype(np.int64) % sectors
    return sector


def rotation_of(vector: Float) -> Float:
    """Return the rotation matrix of a rotation vector (Rodrigues 1840)."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Float = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * (cross @ cross)
    return rotation


def rotation_vector(rotation: Float) -> Float:
    """Return the rotation vector of a rotation by less than half a turn."""
    turn = rotation - rotation.T
    twice: Float = np.array([turn[2, 1], turn[0, 2], turn[1, 0]])
    sine = float(np.linalg.norm(twice)) / 2
    angle = math.atan2(sine, (float(np.trace(rotation)) - 1) / 2)
    return twice * (0.5 * angle / sine if sine > 1e-12 else 0.5)
