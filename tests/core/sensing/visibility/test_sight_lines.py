"""Why a sensor does not see road in its range: a wall hides it, or no beam returns from it."""

from dataclasses import replace

import numpy as np

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.sight_lines import sight_lines
from tests.builders.synthetic_junction import junction_site, rectangle
from tests.engines import ANY

MODELS = load_catalogue()
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
