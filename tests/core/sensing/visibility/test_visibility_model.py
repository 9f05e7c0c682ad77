"""Sensors that hang and are turned anyhow see what a full scan from there sees."""

import math
from dataclasses import replace

from headless.studies.benchmark.visibility import pairs_within

import numpy as np
import pytest

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scans.sensor import level_orientation
from seip_addon.core.sensing.visibility.grid import compute_visibility, seen_from
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.sight_lines import sight_lines
from seip_addon.core.sensing.visibility.visibility_model import visibility_model
from tests.builders.synthetic_junction import junction_site, rectangle
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


def test_a_sensor_mounted_as_its_candidate_sees_the_candidates_row():
    poses = SITE.candidates
    tilted = replace(poses, tilt=np.where(np.arange(len(poses)) % 2, 0.3, 0.0))
    looks = visibility_model(replace(SITE, candidates=tilted), SIGHT, ANY)
    for pose in range(0, len(poses), max(1, len(poses) // 6)):
        for mounted in (poses, tilted):
            row = seen_from(looks, mounted, MODELS, pose)[0]
            model = MODELS[str(mounted.sensor[pose])]
            assert (looks.see(model, mounted.xyz[pose], mounted.orientation(pose)) == row).all()


DELTA = 0.5
AWAY, HALF, TALL = 6.0, 4.0, 9.0
"""Metres from the sensor to the wall, half the wall's width, and its height, which is above the sensor."""


def walled_site():
    """Return a level site with one wall east of the only position."""
    site = junction_site(positions=1, heights=[5.0], sensors=("vlp16",), spacing=2.0)
    x, y, _ = site.candidates.xyz[0]
    foot = [(x + AWAY, y - HALF, 0.0), (x + AWAY, y + HALF, 0.0)]
    top = [(*end[:2], TALL) for end in foot]
    wall = np.array([(foot[0], foot[1], top[1]), (foot[0], top[1], top[0])])
    low, high = (tuple(edge(site.targets.xyz[:, :2], axis=0) + by) for edge, by in ((np.min, -80.0), (np.max, 80.0)))
    triangles = np.concatenate([rectangle(low, high, step=40.0), wall])
    level = replace(site.targets, xyz=site.targets.xyz * (1.0, 1.0, 0.0))
    return replace(site, targets=level, triangles=triangles, reflectivity=np.full(len(triangles), 0.9))


def test_only_road_behind_the_wall_counts_as_hidden():
    site = walled_site()
    settings = VisibilitySettings(delta=DELTA)
    grid = finish(compute_visibility(site, MODELS, settings, ANY))
    row = grid.sees(0)
    sight = sight_lines(site, 0, MODELS["vlp16"], row, DELTA, ANY)

    assert sight.seen == row.sum()
    assert sight.in_range == sight.seen + len(sight.hidden) + len(sight.missed)
    hidden, missed = (
        squares.mean(axis=1)[:, :2] - site.candidates.xyz[0, :2] for squares in (sight.hidden, sight.missed)
    )
    assert len(hidden) > 20
    assert len(missed) > 20
    for places, behind in ((hidden, True), (missed, False)):
        crossing = places[:, 1] * AWAY / np.where(places[:, 0] > 0.0, places[:, 0], np.inf)  # of the wall's plane
        by_edge = np.abs(np.abs(crossing) - HALF) < 1e-6
        just_behind = (places[:, 0] > AWAY) & (places[:, 0] < AWAY + 2 * DELTA)
        in_shadow = (places[:, 0] > AWAY) & (np.abs(crossing) < HALF)
        assert (in_shadow == behind)[~by_edge & ~just_behind].all()
