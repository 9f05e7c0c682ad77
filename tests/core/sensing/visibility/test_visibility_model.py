"""Sensors that hang and are turned anyhow see what a full scan from there sees."""

import math
from dataclasses import replace

from headless.studies.benchmark.visibility import pairs_within

import numpy as np
import pytest

from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scans.sensor import level_orientation
from seip_addon.core.sensing.visibility.grid import seen_from
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.visibility_model import visibility_model
from tests.builders.synthetic_junction import junction_site
from tests.engines import ANY, each_engine
from tests.few import few
from tests.oracles.full_scan import beam_directions

MODELS = load_catalogue()
SITE = junction_site()
SIGHT = VisibilitySettings(delta=1.0)
MODEL = replace(MODELS["type1"], points_per_second=MODELS["type1"].points_per_second / 6)


def turned(yaw, pitch, roll):
    """The rotation about z, then the new y, then the new x."""
    nod = np.array([[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]])
    lean = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
    return level_orientation(yaw) @ nod @ lean


def by_full_scan(caster, model, xyz, orientation, delta=SIGHT.delta):
    directions = beam_directions(model).reshape(-1, 3) @ orientation.T
    distance, triangle = caster.cast(xyz, directions, model.max_range)
    hit = (triangle >= 0) & (distance >= model.min_range)
    seen = np.zeros(len(SITE.targets), dtype=bool)
    _, targets = pairs_within(xyz + directions[hit] * distance[hit, None], SITE.targets.xyz, delta)
    seen[targets] = True
    return seen


@each_engine
@pytest.mark.parametrize(
    "angles", few([(1.0, 0.03, -0.02), (0.0, -0.4, 0.5), (0.4, 0.0, 0.0), (-2.0, 0.6, 0.0), (3.0, 1.5, 3.0)], 2)
)
def test_a_turned_sensor_sees_what_its_full_scan_sees(engine, angles):
    tried = make_ray_caster(SITE.triangles, engine)
    xyz, orientation = np.array([6.0, -7.0, 6.0]), turned(*angles)
    seen = visibility_model(SITE, SIGHT, engine).see(MODEL, xyz, orientation)
    assert (seen == by_full_scan(tried, MODEL, xyz, orientation)).all()
    assert seen.any()


def test_a_level_sensor_sees_what_its_candidate_sees():
    poses = SITE.candidates
    some = np.arange(0, len(poses), max(1, len(poses) // 6))
    looks = visibility_model(SITE, SIGHT, ANY)
    for pose in some:
        row = seen_from(looks, poses, MODELS, pose)[0]
        model = MODELS[str(poses.sensor[pose])]
        seen = looks.see(model, poses.xyz[pose], level_orientation(float(poses.yaw[pose])))
        assert (seen == row).all()
