"""Sizes and shapes drawn for road users: as those of real ones, and nobody runs into another."""

from itertools import combinations
from pathlib import Path

from headless.studies.random_sites.varied_bodies import KINDS, draw_size, resized

import numpy as np
import pytest
import shapely

from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.traffic.trajectories import CATEGORIES, RoadUser, Trajectories
from tests.builders.traffic_by_hand import make_trajectories

SCENES = Path(__file__).parents[3] / "scenes"
RUNS = sorted(SCENES.glob("*_traffic*/run-*.npz"))


def footprint(user, snapshot, place):
    box = shapely.box(-user.length / 2, -user.width / 2, user.length / 2, user.width / 2)
    turned = shapely.affinity.rotate(box, snapshot.yaw[place], origin=(0, 0), use_radians=True)
    return shapely.affinity.translate(turned, *snapshot.position[place, :2])


def common_area(trajectories, time):
    """Largest area that two road users share at an instant."""
    now = trajectories.at(time)
    shapes = [footprint(trajectories.users[number], now, place) for place, number in enumerate(now.user)]
    return max((one.intersection(other).area for one, other in combinations(shapes, 2)), default=0.0)


def many(category, count):
    """Road users of one category, farther apart than any of them is long."""
    users = tuple(RoadUser(f"{n}", category, 0.3, 0.3, 1.0) for n in range(count))
    return make_trajectories(*([(0.0, 40.0 * n, 0.0, 0.0, 0.0, 0.0)] for n in range(count)), users=users)


def sizes(trajectories):
    return np.array([(user.length, user.width, user.height) for user in trajectories.users])


@pytest.mark.parametrize("category", CATEGORIES)
def test_means_and_spreads_are_those_of_the_table(category):
    random = np.random.default_rng(3)
    found = np.array([draw_size(category, random) for _ in range(3000)])
    kinds = list(KINDS[category].values())
    assert sum(kind.share for kind in kinds) == pytest.approx(1.0)
    shares = np.array([kind.share for kind in kinds])
    rows = np.array([(kind.length, kind.width, kind.height) for kind in kinds])
    mean = shares @ rows[..., 0]
    cut = 0.85  # a standard deviation of normal values within two of them is 0.88, of three that all are, less
    spread = np.sqrt(shares @ (rows[..., 0] ** 2 + (cut * rows[..., 1]) ** 2) - mean**2)
    assert found.mean(axis=0) == pytest.approx(mean, abs=4 * spread.max() / np.sqrt(len(found)))
    assert found.std(axis=0) == pytest.approx(spread, rel=0.08)
    low, high = (rows[..., 0] + 2 * sign * rows[..., 1] for sign in (-1, 1))
    assert (found >= low.min(axis=0) - 0.006).all()
    assert (found <= high.max(axis=0) + 0.006).all()


@pytest.mark.parametrize("path", RUNS[:1] + RUNS[-1:], ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_nobody_runs_into_another_in_shipped_traffic(path):
    other = finish(resized(Trajectories.load(path), 0.15, 7))
    begin, end = other.span
    assert max(common_area(other, time) for time in np.arange(begin, end, 2.6)) < 0.03


def test_resized_dimensions_are_uniform_and_nested():
    users = many("car", 800)
    factors = {change: sizes(finish(resized(users, change, 9))) / sizes(users) - 1.0 for change in (0.05, 0.15)}
    assert np.abs(factors[0.15]).max() <= 0.151
    assert factors[0.15].std() == pytest.approx(0.15 / np.sqrt(3), rel=0.05)
    assert np.abs(np.corrcoef(factors[0.15].T)[np.triu_indices(3, 1)]).max() < 0.12
    np.testing.assert_allclose(factors[0.15], 3 * factors[0.05], atol=0.005)
    assert finish(resized(users, 0.0, 9)).users == users.users
