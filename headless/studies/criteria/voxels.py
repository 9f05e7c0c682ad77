"""Voxels over a site's targets: how often road users occupy them and the targets, and which of them sensors see."""

from collections.abc import Sequence
from dataclasses import dataclass

from headless.detection.matching import VEHICLES
from headless.detection.recordings import SampledRun

import numpy as np

from seip_addon.core.base.arrays import Boolean, Float, Integer
from seip_addon.core.sensing.lidar.model import LidarModel
from seip_addon.core.sensing.lidar.noisy_returns import return_chance
from seip_addon.core.sensing.scans.scanner import ReflectiveSurface
from seip_addon.core.sensing.traffic.trajectories import Snapshot, Trajectories
from seip_addon.core.sensing.visibility.ray_casting import RayCaster, make_ray_caster
from seip_addon.core.site.site import Targets

from .vehicle_grid import Vehicles

INTERVAL = 0.5  # seconds between the instants at which occupancy is looked at
LAYER_HEIGHT = 1.0  # metres
LAYERS = 2  # up to the height of most road users
LIKELY = 0.5  # chance of a return from which on a beam counts as one that returns
MARGIN = 1e-3  # metres by which a ray may end before a voxel's middle: engines compute in float32

# The triangles of a box from its corners (4 z + 2 y + x), two on each side.
_BOX_SIDES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
_BOX_TRIANGLES = _BOX_SIDES[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class Voxels:
    """Columns of `LAYERS` voxels that stand on targets; v voxels, layer after layer.

    Parameters
    ----------
    middle : (v, 3) float64, metres
    size : float, metres
        Side in plan.
    """

    middle: Float
    size: float

    @classmethod
    def over(cls, targets: Targets) -> "Voxels":
        """Return the voxels over a site's targets."""
        rise = (np.arange(LAYERS) + 0.5) * LAYER_HEIGHT
        middle = targets.xyz[None] + np.stack([0 * rise, 0 * rise, rise], axis=1)[:, None]
        return cls(middle.reshape(-1, 3), targets.spacing)

    def __len__(self) -> int:
        return len(self.middle)

    def occupant(self, trajectories: Trajectories, now: Snapshot) -> Integer:
        """Return which of the road users of an instant each voxel's middle is in, (v,); -1 for none.

        As with `vehicle_occupancy`, boxes are larger by half a voxel on each side. Of several, the last counts.
        """
        users = [trajectories.users[number] for number in now.user]
        found = np.full(len(self), -1)
        for number, (user, place, yaw) in enumerate(zip(users, now.position, now.yaw, strict=True)):
            offset = self.middle - place
            near = np.flatnonzero(np.abs(offset[:, :2]).max(axis=1) <= user.length + user.width + self.size)
            x, y, z = offset[near].T
            along, across = np.cos(yaw) * x + np.sin(yaw) * y, np.cos(yaw) * y - np.sin(yaw) * x
            inside = (np.abs(along) <= (user.length + self.size) / 2) & (np.abs(across) <= (user.width + self.size) / 2)
            inside &= (z >= -LAYER_HEIGHT / 2) & (z - LAYER_HEIGHT / 2 < user.height)
            found[near[inside]] = number
        return found


def voxel_occupancy(voxels: Voxels, runs: Sequence[SampledRun]) -> Float:
    """Return the share of time for which a road user is in each voxel, (v,): a traffic probabilistic occupancy grid."""
    held, instants = np.zeros(len(voxels), dtype=np.int64), 0
    for run in runs:
        for time in np.arange(run.times[0], run.trajectories.span[1], INTERVAL).tolist():
            held += voxels.occupant(run.trajectories, run.trajectories.at(time)) >= 0
            instants += 1
    return held / instants


def vehicle_occupancy(targets: Targets, runs: Sequence[SampledRun]) -> Float:
    """Return the share of time for which a vehicle stands on each target's square, (t,).

    A vehicle stands on a square whose middle its box holds when it is enlarged by half the spacing on each side.
    """
    held, instants = np.zeros(len(targets), dtype=np.int64), 0
    for run in runs:
        users = run.trajectories.users
        reach = np.array([(user.length, user.width) for user in users]) / 2 + targets.spacing / 2
        vehicle = np.array([user.category in VEHICLES for user in users])
        for time in np.arange(run.times[0], run.trajectories.span[1], INTERVAL).tolist():
            now = run.trajectories.at(time)
            here = vehicle[now.user]
            offset = targets.xyz[None, :, :2] - now.position[here, None, :2]
            cos, sin = np.cos(now.yaw[here])[:, None], np.sin(now.yaw[here])[:, None]
            along, across = cos * offset[..., 0] + sin * offset[..., 1], cos * offset[..., 1] - sin * offset[..., 0]
            most = reach[now.user[here]]
            held += ((np.abs(along) <= most[:, :1]) & (np.abs(across) <= most[:, 1:])).any(axis=0)
            instants += 1
    return held / instants


@dataclass(frozen=True, eq=False)
class TrafficInstant:
    """The boxes of the road users of an instant, as what hides voxels.

    Parameters
    ----------
    caster : RayCaster or None
        Triangles of the road users, 12 each; None without road users.
    occupant : (v,) int64
        As `Voxels.occupant` returns it.
    """

    caster: RayCaster | None
    occupant: Integer

    @classmethod
    def of(cls, voxels: Voxels, trajectories: Trajectories, now: Snapshot) -> "TrafficInstant":
        """Return the road users of an instant."""
        users = [trajectories.users[number] for number in now.user]
        sizes = np.array([(user.length, user.width, user.height) for user in users]).reshape(-1, 3)
        corners = Vehicles(now.position, now.yaw, sizes).corners
        caster = make_ray_caster(corners[:, _BOX_TRIANGLES].reshape(-1, 3, 3)) if users else None
        return cls(caster, voxels.occupant(trajectories, now))

    def leaves(self, origin: Float, directions: Float, distance: Float) -> Boolean:
        """Return which voxels (v,) can be seen along rays to their middles; the surface of what is in one counts."""
        if self.caster is None:
            return np.ones(len(distance), dtype=bool)
        met, triangle = self.caster.cast(origin, directions, float(distance.max()) + 1.0)
        seen: Boolean = (met >= distance - MARGIN) | ((self.occupant >= 0) & (triangle // 12 == self.occupant))
        return seen


@dataclass(frozen=True, eq=False)
class SeenVoxels:
    """Voxels as one sensor sees them.

    Parameters
    ----------
    covered : (v,) bool
        Within its field of view and range, hidden or not.
    free : (v,) bool
        Covered, and not hidden by the static scene.
    passed : (v,) bool
        Free, and passed by beams that return from the empty scene: some beam does with a chance of `LIKELY` or more.
    unhidden : (i, v) bool
        Free, and not hidden by road users at each of i instants.
    """

    covered: Boolean
    free: Boolean
    passed: Boolean
    unhidden: Boolean


def seen_voxels(
    voxels: Voxels,
    ground: ReflectiveSurface,
    instants: Sequence[TrafficInstant],
    model: LidarModel,
    origin: Float,
    orientation: Float,
) -> SeenVoxels:
    """Return the voxels that a sensor with channels sees; one ray is cast to the middle of each.

    Parameters
    ----------
    ground : ReflectiveSurface
        The static scene.
    origin : (3,) float64, metres
    orientation : (3, 3) float64
        Rotation from the sensor's axes to the site's.
    """
    offset = voxels.middle - origin
    distance = np.linalg.norm(offset, axis=1)
    directions = offset / distance[:, None]
    local = offset @ orientation
    level = np.hypot(local[:, 0], local[:, 1])
    slopes = np.sort(np.tan(model.elevations))
    low, high = ((local[:, 2] + side * LAYER_HEIGHT / 2) / np.maximum(level, voxels.size / 2) for side in (-1, 1))
    channels = np.searchsorted(slopes, high, "right") - np.searchsorted(slopes, low, "left")
    facing = model.faces(local) & (distance >= model.min_range) & (distance <= model.max_range)
    covered = facing & (high >= slopes[0]) & (low <= slopes[-1])
    met, triangle = ground.caster.cast(origin, directions, model.max_range)
    free = covered & (met >= distance - MARGIN)
    ends = np.flatnonzero(free & (triangle >= 0) & (channels > 0))
    chance = return_chance(model, met[ends], ground.reflected(directions[ends], triangle[ends]))
    beams = channels[ends] * np.maximum(voxels.size / level[ends] / model.azimuth_step, 1.0)
    passed = np.zeros(len(voxels), dtype=bool)
    passed[ends] = 1.0 - (1.0 - np.minimum(chance, 1.0)) ** beams >= LIKELY
    unhidden = np.array([free & instant.leaves(origin, directions, distance) for instant in instants])
    return SeenVoxels(covered, free, passed, unhidden.reshape(len(instants), len(voxels)))
