"""Cells of vehicles' top, side and front views, and how likely a sensor's points fall into each."""

from collections.abc import Sequence
from dataclasses import dataclass

from headless.detection.matching import VEHICLES
from headless.detection.recordings import SampledRun

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from seip_addon.core.arrays import Boolean, Float, Integer
from seip_addon.core.sensing.lidar.beams import BeamPattern
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.scans.beam_culling import BeamWindows
from seip_addon.core.sensing.visibility.ray_casting import RayCaster

CELLS = (20, 8, 6)  # along, across and up: of a car of 5.0 × 1.8 × 1.5 m each is about 0.25 m wide
VIEWS = ((0, 1), (0, 2), (1, 2))  # axes that the top, side and front view show
VIEW_CELLS = tuple(CELLS[one] * CELLS[other] for one, other in VIEWS)
REFLECTIVITY = 0.3  # of paint, about that of the panels by which placements by returns count
LEAST_LOG_MISS = -30.0  # below it a cell is certain to be hit

_CORNERS = np.array([(x, y, z) for z in (0, 1) for y in (-0.5, 0.5) for x in (-0.5, 0.5)])


@dataclass(frozen=True, eq=False)
class Vehicles:
    """Vehicles at n places, as boxes that stand on the road.

    Parameters
    ----------
    place : (n, 3) float64, metres
        Middle of the underside.
    yaw : (n,) float64, radians
    size : (n, 3) float64, metres
        Length, width, height.
    """

    place: Float
    yaw: Float
    size: Float

    def __len__(self) -> int:
        return len(self.place)

    @property
    def attitude(self) -> Float:
        """Rotations from the axes of each to the site's, (n, 3, 3)."""
        cos, sin, one, zero = np.cos(self.yaw), np.sin(self.yaw), np.ones(len(self)), np.zeros(len(self))
        rows = [[cos, -sin, zero], [sin, cos, zero], [zero, zero, one]]
        return np.moveaxis(np.array(rows), -1, 0)

    @property
    def corners(self) -> Float:
        """Corners of the boxes, (n, 8, 3)."""
        local = _CORNERS * self.size[:, None]
        corners: Float = self.place[:, None] + np.einsum("nij,nkj->nki", self.attitude, local)
        return corners


def vehicles_in(runs: Sequence[SampledRun], region: BaseGeometry, most: int, interval: float = 5.0) -> Vehicles:
    """Return at most n vehicles in the region at instants of runs, spread evenly over all."""
    rows = []
    for run in runs:
        users = run.trajectories.users
        for time in np.arange(run.times[0], run.trajectories.span[1], interval).tolist():
            now = run.trajectories.at(time)
            rows += [
                (*place, yaw, users[user].length, users[user].width, users[user].height)
                for user, place, yaw in zip(now.user.tolist(), now.position, now.yaw.tolist(), strict=True)
                if users[user].category in VEHICLES
            ]
    found = np.array(rows, dtype=np.float64).reshape(-1, 7)
    found = found[shapely.contains_xy(region, found[:, 0], found[:, 1])]
    picked = found[np.unique(np.linspace(0, len(found) - 1, min(most, len(found))).round().astype(np.int64))]
    return Vehicles(picked[:, :3], picked[:, 3], picked[:, 4:])


def log_misses(
    caster: RayCaster, model: LidarModel, origin: Float, orientation: Float, vehicles: Vehicles
) -> NDArray[np.float32]:
    r"""Return the logarithm of the chance that no point of a sensor falls into each cell, (n, cells of all views).

    With P the chance of each ray that ends in the cell to return, it is :math:`\sum \ln(1 - P)`, and adds up over
    sensors. A ray ends on the vehicle's box unless the static scene stops it; other traffic is left out.

    Parameters
    ----------
    caster : RayCaster
        Ray caster of the static scene.
    """
    vehicle, ray = BeamWindows(model).rays_towards((vehicles.corners - origin) @ orientation)
    directions = BeamPattern(model).directions(ray) @ orientation.T
    attitude = vehicles.attitude
    start = np.einsum("nji,nj->ni", attitude, origin - vehicles.place)[vehicle]
    local = np.einsum("nji,nj->ni", attitude[vehicle], directions)
    low = np.column_stack([-vehicles.size[:, :2] / 2, np.zeros(len(vehicles))])[vehicle]
    size = vehicles.size[vehicle]
    enter, side = _entry(start, local, low, low + size)
    hit = np.flatnonzero(np.isfinite(enter) & (enter >= model.min_range) & (enter <= model.max_range))
    met = np.full(len(ray), np.inf)
    met[hit] = caster.cast(origin, directions[hit], model.max_range)[0]
    hit = hit[met[hit] >= enter[hit]]
    cosine = np.abs(np.take_along_axis(local[hit], side[hit][:, None], axis=1)[:, 0])
    chance = model.law.chance(enter[hit], REFLECTIVITY * cosine)
    share = (start[hit] + enter[hit][:, None] * local[hit] - low[hit]) / size[hit]
    cell = np.clip((share * CELLS).astype(np.int64), 0, np.array(CELLS) - 1)
    with np.errstate(divide="ignore"):
        miss = np.maximum(np.log1p(-np.minimum(chance, 1.0)), LEAST_LOG_MISS)
    total = np.zeros((len(vehicles), sum(VIEW_CELLS)))
    for view, (one, other) in enumerate(VIEWS):
        column = sum(VIEW_CELLS[:view]) + cell[:, one] * CELLS[other] + cell[:, other]
        total += np.bincount(vehicle[hit] * total.shape[1] + column, miss, minlength=total.size).reshape(total.shape)
    return np.maximum(total, LEAST_LOG_MISS).astype(np.float32)


def _entry(start: Float, direction: Float, low: Float, high: Float) -> tuple[Float, Integer]:
    """Return how far rays go to boxes by their slabs (infinite on a miss), and the axis of the side that they meet."""
    slowness = 1.0 / np.where(np.abs(direction) < 1e-12, 1e-12, direction)
    one, other = (low - start) * slowness, (high - start) * slowness
    near, leave = np.minimum(one, other), np.maximum(one, other).min(axis=1)
    side = near.argmax(axis=1)
    enter = near.max(axis=1)
    hits: Boolean = (enter <= leave) & (enter > 0)
    return np.where(hits, enter, np.inf), side
