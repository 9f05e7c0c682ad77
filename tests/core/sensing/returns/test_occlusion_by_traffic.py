"""Chance that traffic hides no road user, against random road users along the line of sight."""

import math

import numpy as np
import pytest

from seip_addon.core.sensing.returns.bodies import PANELS
from seip_addon.core.sensing.returns.occlusion import HIDING, clear_chance, returns_in_traffic
from seip_addon.core.sensing.returns.road_users import BODIES, RoadUsers


def users_at(points, bodies):
    count = len(points)
    no = np.full(count, -1)
    return RoadUsers(np.array(points, float), np.array(bodies), np.ones(count), no > 0, no, ())


def clear_share(sensor, user, body, draws, random):
    """Share of draws in which no obstacle of a Poisson process, as high as a car, stands above the line of sight."""
    middle = user + np.array([0.0, 0.0, PANELS[BODIES[body]].height / 2])
    far = math.hypot(*(sensor - user)[:2])
    clear = 0
    for _ in range(draws):
        obstacles = random.uniform(0.0, far, random.poisson(HIDING * far)) / max(far, 1e-9)
        line = middle[2] + obstacles * (sensor[2] - middle[2])
        clear += not (line < user[2] + PANELS["car"].height).any()
    return clear / draws


@pytest.mark.parametrize("height", [0.4, 1.2, 1.6, 3.5, 8.0])
@pytest.mark.parametrize("body", range(len(BODIES)))
def test_chance_is_the_share_of_random_traffic_that_leaves_the_view_free(height, body):
    random = np.random.default_rng(7)
    sensor = np.array([3.0, -2.0, 5.0 + height])
    points = [[3.0, -1.0, 5.0], [15.0, 4.0, 5.0], [-30.0, 20.0, 5.0]]
    found = clear_chance(sensor, users_at(points, [body] * len(points)))
    draws = 4000
    for chance, point in zip(found, points, strict=True):
        share = clear_share(sensor, np.array(point), body, draws, random)
        assert share == pytest.approx(chance, abs=4 * math.sqrt(chance * (1 - chance) / draws) + 1e-3)


def test_returns_in_traffic_are_those_in_plain_view_times_the_chance():
    random = np.random.default_rng(3)
    users = users_at(random.uniform(-60, 60, (20, 3)), random.integers(0, 3, 20))
    origins, returns = random.uniform(-20, 20, (4, 3)), random.gamma(1.0, 50.0, (4, 20)).astype(np.float32)
    found = returns_in_traffic(returns, origins, users)
    assert found.dtype == np.float32
    expected = [each * clear_chance(origin, users) for each, origin in zip(returns, origins, strict=True)]
    np.testing.assert_allclose(found, expected, rtol=1e-6)
