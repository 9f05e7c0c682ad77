"""Occupancy of cells in vehicles' top, side and front views: the chance that a sensor's points fall into each."""

from collections.abc import Sequence
from dataclasses import dataclass

from headless.detection.matching import VEHICLES
from headless.detection.recordings import SampledRun

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from seip_addon.core.base.arrays import Boolean, Float, Integer
from seip_addon.core.sensing.lidar.beams import BeamPattern
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.scans.beam_culling import rays_towards
from seip_addon.core.sensing.visibility.ray_casting import RayCaster

CELLS = (20, 8, 6)  # along, across and up: about 0.25 m each on a car of 5.0 × 1.8 × 1.5 m
VIEWS = ((0, 1), (0, 2), (1, 2))  # axes of the top, side and front view
VIEW_CELLS = tuple(CELLS[one] * CELLS[other] for one, other in VIEWS)
REFLECTIVITY = 0.3  # paint; about that of the panels that count returns in placements by returns
LEAST_LOG_MISS = -30.0  # a miss of chance e^-30 counts as impossible; keeps sums finite

# Corners of a box of size 1 that stands on the origin.
_CORNERS = np.array([(x, y, z) for z in (0, 1) for y in (-0.5, 0.5) for x in (-0.5, 0.5)])


@dataclass(frozen=True, eq=False)
class Vehicles:
    """n vehicles as boxes that stand on the road.

    Parameters
    ----------
    position : (n, 3) float64, metres
        Centre of the underside.
    yaw : (n,) float64, radians
    size : (n, 3) float64, metres
        Length, width, height.
    """

    position: Float
    yaw: Float
    size: Float

    def __len__(self) -> int:
        return len(self.position)

    @property
    def rotation(self) -> Float:
        """Rotations from the axes of each vehicle to the site's, (n, 3, 3)."""
        cos, sin, one, zero = np.cos(self.yaw), np.sin(self.yaw), np.ones(len(self)), np.zeros(len(self))
        rows = [[cos, -sin, zero], [sin, cos, zero], [zero, zero, one]]
        return np.moveaxis(np.array(rows), -1, 0)

    @property
    def corners(self) -> Float:
        """Corners of the boxes, (n, 8, 3) in metres."""
        local = _CORNERS * self.size[:, None]
        corners: Float = self.position[:, None] + np.einsum("nij,nkj->nki", self.rotation, local)
        return corners


def vehicles_in(runs: Sequence[SampledRun], region: BaseGeometry, most: int, interval: float = 5.0) -> Vehicles:
    """Return a sample of the vehicles in a region, spread evenly over all runs.

    Parameters
    ----------
    most : int
        Maximum number of vehicles.
    interval : float, seconds
        Time between the instants at which vehicles are taken from each run.
    """
    rows = []
    for run in runs:
        users = run.trajectories.users
        for time in np.arange(run.times[0], run.trajectories.span[1], interval).tolist():
            now = run.trajectories.at(time)
            rows += [
                (*position, yaw, users[user].length, users[user].width, users[user].height)
                for user, position, yaw in zip(now.user.tolist(), now.position, now.yaw.tolist(), strict=True)
                if users[user].category in VEHICLES
            ]
    found = np.array(rows, dtype=np.float64).reshape(-1, 7)
    found = found[shapely.contains_xy(region, found[:, 0], found[:, 1])]
    sample = found[np.unique(np.linspace(0, len(found) - 1, min(most, len(found))).round().astype(np.int64))]
    return Vehicles(position=sample[:, :3], yaw=sample[:, 3], size=sample[:, 4:])


def log_misses(
    caster: RayCaster, model: LidarModel, origin: Float, orientation: Float, vehicles: Vehicles
) -> NDArray[np.float32]:
    r"""Return the logarithm of the chance that no point of a sensor falls into each cell.

    It is :math:`\sum \ln(1 - P)` over the rays that end in the cell, with P the probability that the ray returns. The
    logarithms of several sensors add up. A ray ends on the vehicle's box unless the static scene stops it before; other
    traffic is left out.

    Parameters
    ----------
    caster : RayCaster
        Ray caster of the static scene.
    origin : (3,) float64, metres
        Position of the sensor.
    orientation : (3, 3) float64
        Rotation from the sensor's axes to the site's.

    Returns
    -------
    (n, g) float32
        For each vehicle, the cells of the top, side and front view one after the other; `LEAST_LOG_MISS` at least.
    """
    # candidate pairs of vehicle and ray
    vehicle, ray = rays_towards(model, (vehicles.corners - origin) @ orientation)
    directions = BeamPattern(model).directions(ray) @ orientation.T
    # rays and boxes in the axes of each pair's vehicle
    rotation, size = vehicles.rotation, vehicles.size[vehicle]
    start = np.einsum("nji,nj->ni", rotation, origin - vehicles.position)[vehicle]
    local = np.einsum("nji,nj->ni", rotation[vehicle], directions)
    low = np.column_stack([-vehicles.size[:, :2] / 2, np.zeros(len(vehicles))])[vehicle]
    distance, side = _box_entry(start, local, low, low + size)
    # rays that reach the box, within the sensor's range and in front of the static scene
    hit = np.flatnonzero(np.isfinite(distance) & (distance >= model.min_range) & (distance <= model.max_range))
    hit = hit[caster.cast(origin, directions[hit], model.max_range)[0] >= distance[hit]]
    # chance of a return from the side that each ray meets
    cosine = np.abs(np.take_along_axis(local[hit], side[hit][:, None], axis=1)[:, 0])
    chance = model.law.chance(distance[hit], REFLECTIVITY * cosine)
    with np.errstate(divide="ignore"):
        log_miss = np.maximum(np.log1p(-np.minimum(chance, 1.0)), LEAST_LOG_MISS)
    # the hit's share of length, width and height gives its cell along each axis
    share = (start[hit] + distance[hit][:, None] * local[hit] - low[hit]) / size[hit]
    cell = np.clip((share * CELLS).astype(np.int64), 0, np.array(CELLS) - 1)
    total = _sum_in_views(log_miss, vehicle[hit], cell, len(vehicles))
    return np.maximum(total, LEAST_LOG_MISS).astype(np.float32)


def _box_entry(start: Float, direction: Float, low: Float, high: Float) -> tuple[Float, Integer]:
    """Intersect rays with axis-aligned boxes by the slab method (Kay and Kajiya 1986).

    Parameters
    ----------
    start, direction : (p, 3) float64
    low, high : (p, 3) float64, metres
        Opposite corners of each ray's box.

    Returns
    -------
    distance : (p,) float64, metres
        Distance at which the ray enters the box; infinite on a miss, or if it starts inside.
    axis : (p,) int64
        Axis normal to the side through which it enters.
    """
    slowness = 1.0 / np.where(np.abs(direction) < 1e-12, 1e-12, direction)
    one, other = (low - start) * slowness, (high - start) * slowness
    near, leave = np.minimum(one, other), np.maximum(one, other).min(axis=1)
    enter = near.max(axis=1)
    hits: Boolean = (enter <= leave) & (enter > 0)
    return np.where(hits, enter, np.inf), near.argmax(axis=1)


def _sum_in_views(values: Float, vehicle: Integer, cell: Integer, count: int) -> Float:
    """Sum the values of hits in each cell of each view, (count, g).

    Parameters
    ----------
    values : (h,) float64
    vehicle : (h,) int64
        Vehicle of each hit, below ``count``.
    cell : (h, 3) int64
        Cell of each hit along length, width and height.
    """
    total = np.zeros((count, sum(VIEW_CELLS)))
    for view, (one, other) in enumerate(VIEWS):
        column = sum(VIEW_CELLS[:view]) + cell[:, one] * CELLS[other] + cell[:, other]
        flat = vehicle * total.shape[1] + column
        total += np.bincount(flat, values, minlength=total.size).reshape(total.shape)
    return total
