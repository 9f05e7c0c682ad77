"""Ground below background points: planes, kerbs, walls and plants, and the pose of a sensor above it."""

import math

import numpy as np
import pytest

from seip_addon.core.sensing.recordings.ground import estimated_ground, pose_above_ground
from tests.builders.scan_frames import rotation

KERB, KERB_AT = 0.15, 8.0
WALL_AT = 14.0


def street(seed=0, slope=(0.0, 0.0), height=6.0, noise=0.02):
    """Return background points of a street with kerb, wall, hedge and crowns, and the height of its ground.

    The rays of a spinning sensor in the origin, ``height`` above the ground, as a dense sensor has them.
    """
    random = np.random.default_rng(seed)
    azimuth = np.arange(1200) * (math.tau / 1200)
    elevation = np.radians(np.linspace(-40, -3, 90))
    reach = height / np.tan(-elevation)
    x, y = (np.outer(reach, part(azimuth)).ravel() for part in (np.cos, np.sin))

    def ground(x, y):
        return slope[0] * x + slope[1] * y - height + np.where(y > KERB_AT, KERB, 0.0)

    street = y < WALL_AT
    hidden = (x > 6) & (x < 20) & (y > 9) & (y < 10)  # below the hedge
    flat = np.column_stack([x, y, ground(x, y)])[street & ~hidden]
    along = random.uniform(-50, 50, 20_000)
    wall = np.column_stack(
        [along, np.full(len(along), WALL_AT), ground(along, WALL_AT) + random.uniform(0, 9, len(along))]
    )
    x, y = random.uniform(6, 20, 3000), random.uniform(9, 10, 3000)
    hedge = np.column_stack([x, y, ground(x, y) + random.uniform(0.4, 1.5, 3000)])
    x, y = random.uniform(-30, -10, 5000), random.uniform(-20, -10, 5000)
    crowns = np.column_stack([x, y, ground(x, y) + random.uniform(2.5, 8, 5000)])
    points = np.concatenate([flat, wall, hedge, crowns])
    return points + random.normal(0, noise, points.shape), ground


@pytest.mark.parametrize("slope", [(0.0, 0.0), (0.04, 0.0), (0.08, 0.0), (-0.05, 0.06)])
def test_the_ground_follows_slopes_and_kerbs_but_not_walls_and_plants(slope):
    points, ground = street(slope=slope)
    raster = estimated_ground(points)
    random = np.random.default_rng(1)
    distance, angle = 40 * np.sqrt(random.random(4000)), random.uniform(-math.pi, math.pi, 4000)
    x, y = distance * np.cos(angle), distance * np.sin(angle)
    road = y < WALL_AT - 1
    x, y = x[road], y[road]
    error = raster.at(np.column_stack([x, y])) - ground(x, y)
    beside = np.abs(y - KERB_AT) < 1.5
    assert np.quantile(np.abs(error[~beside]), 0.99) < 0.06
    assert np.abs(error[~beside]).max() < 0.1  # below the sensor and the hedge too
    assert np.abs(error[beside]).max() < KERB + 0.1


@pytest.mark.parametrize("seed", range(12))
def test_the_pose_above_the_ground_is_that_of_the_sensor(seed):
    random = np.random.default_rng(seed)
    height, tilt, around = random.uniform(3, 9), math.radians(random.uniform(0, 30)), random.uniform(-math.pi, math.pi)
    points, _ = street(seed, height=height)
    axis = rotation(around)
    orientation = axis @ rotation(0.0, tilt) @ axis.T  # the sensor's axes in level ones
    pose = pose_above_ground(points @ orientation, "S1")
    assert pose[:3, 3] == pytest.approx([0.0, 0.0, height], abs=0.05)
    assert np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
    up = pose[:3, :3].T @ [0, 0, 1]
    assert up @ (orientation.T @ [0, 0, 1]) > math.cos(math.radians(0.5))
    forward = pose[:3, :3] @ [1, 0, 0]
    assert math.atan2(forward[1], forward[0]) == pytest.approx(0.0, abs=1e-9)  # azimuth zero keeps its direction
