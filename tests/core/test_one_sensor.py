"""What a sensor sees that a hand has moved: where it hangs on a candidate's place, what the grid says."""

import numpy as np
import pytest
from engines import ANY
from synthetic_junction import junction_site

from seip_addon.core.lidar import load_catalogue
from seip_addon.core.progress import finish
from seip_addon.core.scans.sensor import MountedSensor, level_orientation
from seip_addon.core.visibility.grid import VisibilitySettings, compute_visibility
from seip_addon.core.visibility.one_sensor import Onlooker

SITE = junction_site(positions=8, heights=[5.0], spacing=2.0)
MODELS = load_catalogue()
SETTINGS = VisibilitySettings()


def tilted(angle: float) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])


@pytest.mark.parametrize("angle", [0.0, 2e-6])
def test_it_sees_what_the_grid_says(angle):
    """A tilt of two millionths of a radian is cast ray by ray, and moves returns by tenths of millimetres."""
    grid = finish(compute_visibility(SITE, MODELS, SETTINGS, ANY)).visible
    onlooker = Onlooker(SITE, SETTINGS, ANY)
    poses = SITE.candidates
    for pose in range(0, len(poses), 5):
        orientation = level_orientation(float(poses.yaw[pose])) @ tilted(angle)
        sensor = MountedSensor("S1", MODELS[str(poses.sensor[pose])], poses.xyz[pose], orientation)
        differing = np.count_nonzero(onlooker.seen_from(sensor) != grid[pose])
        assert differing == 0 if angle == 0.0 else differing <= 2


def test_a_sensor_on_its_side_sees_other_targets():
    onlooker = Onlooker(SITE, SETTINGS, ANY)
    place = SITE.candidates.xyz[0]
    level = onlooker.seen_from(MountedSensor("S1", MODELS["type1"], place, level_orientation(0.0)))
    aside = onlooker.seen_from(MountedSensor("S1", MODELS["type1"], place, tilted(np.pi / 2)))
    assert level.any()
    assert aside.any()
    assert (level != aside).any()
