"""Ground of a recording: heights estimated from background points, and the pose of a sensor above it."""

from __future__ import annotations

import math

import numpy as np

from ...base.arrays import Boolean, Float, Integer
from ...base.errors import SeipError
from ...geometry.height_raster import HeightRaster

_STEP = 1.0  # metres between heights
_LOW_SHARE = 0.1  # quantile of the heights in a cell: below leaves and walls, above stray points
_BLOCK = 8  # cells along a side of a block, in which the lowest cells are taken for ground first
_PASSES = ((8.0, 0.8), (4.0, 0.4), (2.0, 0.25))
"""Width of the smoothing in each pass, and height up to which cells are ground then, metres."""
_DRAWS = 500  # planes tried
_PLANE_MARGIN = 0.15  # metres from a plane within which a point supports it
_MAX_TILT = math.radians(45)
_PLANE_RADIUS = 30.0  # metres around the sensor in which the ground is taken for a plane
_LEAST_GROUND = 200  # points


def estimated_ground(points: Float) -> HeightRaster:
    """Estimate the ground below background points.

    The cells with the lowest points of each block begin a surface; in each of three passes the surface is smoothed
    less, and cells near it belong to it, so that it follows kerbs and slopes but not walls, hedges or roofs.

    Parameters
    ----------
    points : (n, 3) float64, metres
        Background in axes with z up.

    Raises
    ------
    SeipError
        There are too few points.
    """
    if len(points) < _LEAST_GROUND:
        raise SeipError(f"the recording has {len(points)} background points: the ground cannot be estimated")
    low = np.floor(points[:, :2].min(axis=0) / _STEP) * _STEP
    columns, rows = (np.floor((points[:, :2].max(axis=0) - low) / _STEP).astype(np.int64) + 1).tolist()
    column, row = np.floor((points[:, :2] - low) / _STEP).astype(np.int64).T
    cell = row * columns + column
    # Heights are above the plane of the whole site, so that it goes on below the sensor, where there are no points.
    plane = _plane_of(points)
    heights = _quantile_by(cell, points[:, 2] - _at(points[:, :2], plane), rows * columns, _LOW_SHARE)
    block = (np.arange(rows)[:, None] // _BLOCK) * columns + np.arange(columns) // _BLOCK
    known = np.isfinite(heights)
    lowest = _quantile_by(block.ravel()[known], heights[known], rows * columns, _LOW_SHARE)
    raster = HeightRaster(low + _STEP / 2, _STEP, heights.reshape(rows, columns))
    surface = lowest[block]
    for width, margin in _PASSES:
        near = np.abs(raster.heights - surface) <= margin
        if not near.any():
            break
        surface = HeightRaster(raster.low, _STEP, np.where(near, raster.heights, np.nan)).smoothed(width).heights
    near = np.abs(raster.heights - surface) <= _PASSES[-1][1]
    heights = np.where(near, raster.heights, surface)
    heights += _at(raster.places, plane).reshape(heights.shape)
    # Library functions may differ in the last bit between two calls. Rounded, a recording has one ground.
    return HeightRaster(raster.low, _STEP, np.round(heights, 6))


def pose_above_ground(points: Float, name: str) -> Float:
    """Return the pose (4, 4) of a sensor in level axes with their origin on the ground below it.

    The plane that most of the points near the sensor support (Fischler and Bolles 1981) is the ground. Its normal is
    up, and the sensor's azimuth zero keeps its direction.

    Parameters
    ----------
    points : (n, 3) float64, metres
        Background in the sensor's axes.

    Raises
    ------
    SeipError
        There is no plane below the sensor.
    """
    near = points[np.hypot(points[:, 0], points[:, 1]) < _PLANE_RADIUS]
    below = near[near[:, 2] < 0]
    if len(below) < _LEAST_GROUND:
        raise SeipError(f"{name}: there is no ground within {_PLANE_RADIUS:g} m of the sensor: give its pose")
    normal, inside = _best_plane(below)
    middle = below[inside].mean(axis=0)
    # Least squares over the supporting points: the direction in which they vary least.
    normal = np.linalg.svd(below[inside] - middle, full_matrices=False)[2][2]
    # The bits of a decomposition depend on where its matrix lies in memory. Rounded, a recording has one pose.
    normal = np.round(normal * np.sign(normal[2]), 9)
    normal /= np.sqrt((normal**2).sum())
    forward = np.array([1.0, 0.0, 0.0]) - normal[0] * normal
    forward /= np.linalg.norm(forward)
    rotation = np.stack([forward, np.cross(normal, forward), normal])
    pose = np.eye(4)
    pose[:3, :3] = rotation
    pose[2, 3] = round(-float(normal @ middle), 6)
    return pose


def _plane_of(points: Float) -> Float:
    """Return the plane (3,) below points: height in the origin, and slopes along x and y."""
    block = np.unique(np.floor(points[:, :2] / _BLOCK).astype(np.int64), axis=0, return_inverse=True)[1].ravel()
    order = np.lexsort([points[:, 2], block])
    lowest = points[order[np.unique(block[order], return_index=True)[1]]]
    plane = np.zeros(3)
    for margin in (np.inf, 2.0, 1.0, 0.5):  # walls and roofs leave the fit
        near = lowest[np.abs(lowest[:, 2] - _at(lowest[:, :2], plane)) <= margin]
        if len(near) < 3:  # corners of a plane
            break
        plane = np.linalg.lstsq(np.column_stack([np.ones(len(near)), near[:, :2]]), near[:, 2], rcond=None)[0]
    return np.round(plane, 6)  # least squares have not the same bits in every run


def _at(xy: Float, plane: Float) -> Float:
    heights: Float = plane[0] + plane[1] * xy[:, 0] + plane[2] * xy[:, 1]  # the same bits in every run
    return heights


def _best_plane(points: Float) -> tuple[Float, Boolean]:
    random = np.random.default_rng(0)
    corner = points[random.integers(len(points), size=(_DRAWS, 3))]
    normals = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    length = np.linalg.norm(normals, axis=1)
    normals = normals / np.maximum(length, 1e-12)[:, None]
    level = (np.abs(normals[:, 2]) > math.cos(_MAX_TILT)) & (length > 1e-6)
    normals, corner = normals[level], corner[level, 0]
    thinned = points[:: max(1, len(points) // 5000)]
    offset = np.einsum("di,di->d", normals, corner)
    support = (np.abs(thinned @ normals.T - offset) <= _PLANE_MARGIN).sum(axis=0)
    best = int(support.argmax())
    return normals[best], np.abs(points @ normals[best] - offset[best]) <= _PLANE_MARGIN


def _quantile_by(group: Integer, values: Float, groups: int, share: float) -> Float:
    """Return a quantile of the values in each group, (groups,); NaN for empty groups."""
    order = np.lexsort([values, group])
    count = np.bincount(group, minlength=groups)
    first = np.cumsum(count) - count
    place = first + np.floor(share * np.maximum(count - 1, 0)).astype(np.int64)
    found = np.full(groups, np.nan)
    some = count > 0
    found[some] = values[order[place[some]]]
    return found
