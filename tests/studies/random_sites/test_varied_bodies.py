"""Sizes and shapes drawn for road users: as those of real ones, and nobody runs into another."""

from itertools import combinations, pairwise
from pathlib import Path

from headless.studies.random_sites.varied_bodies import KINDS, draw_size, resized, varied

import numpy as np
import pytest
import shapely

from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
from seip_addon.core.sensing.traffic.trajectories import CATEGORIES, RoadUser, Trajectories
from tests.builders.traffic_by_hand import make_trajectories, parked

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


def many(category, count=3000):
    """Road users of one category, farther apart than any of them is long."""
    users = tuple(RoadUser(f"{n}", category, 0.3, 0.3, 1.0) for n in range(count))
    return make_trajectories(*([(0.0, 40.0 * n, 0.0, 0.0, 0.0, 0.0)] for n in range(count)), users=users)


def sizes(trajectories):
    return np.array([(user.length, user.width, user.height) for user in trajectories.users])


@pytest.mark.parametrize("category", CATEGORIES)
def test_means_and_spreads_are_those_of_the_table(category):
    found = sizes(finish(varied(many(category), 3)))
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


def test_cars_are_as_long_and_as_correlated_as_real_ones():
    cars = sizes(finish(varied(many("car"), 1)))
    assert 3.6 <= cars[:, 0].min() < 3.75
    assert 5.0 < cars[:, 0].max() <= 5.2
    assert np.corrcoef(cars.T)[0, 1] > 0.7
    people = sizes(finish(varied(many("pedestrian"), 1)))[:, 2]
    assert np.mean((people >= 1.5) & (people <= 1.95)) > 0.85


def test_one_seed_gives_the_same_bytes_and_another_other_bodies(tmp_path):
    run = Trajectories.load(RUNS[0])
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        finish(varied(run, seed)).save(tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    one, other = (Trajectories.load(tmp_path / name) for name in ("a", "c"))
    assert one.users == finish(varied(run, 1)).users
    assert len({one.key, other.key, run.key}) == 3
    assert all(a.shape != b.shape for a, b in zip(one.users, other.users, strict=True))
    assert [(user.name, user.category, user.paint) for user in one.users] == [
        (user.name, user.category, user.paint) for user in run.users
    ]
    np.testing.assert_array_equal(one.position, run.position)


@pytest.mark.parametrize("path", RUNS[:1] + RUNS[-1:], ids=lambda path: f"{path.parent.name}-{path.stem}")
@pytest.mark.parametrize("change", [lambda run: varied(run, 7), lambda run: resized(run, 0.15, 7)], ids=["own", "15 %"])
def test_nobody_runs_into_another_in_shipped_traffic(path, change):
    other = finish(change(Trajectories.load(path)))
    begin, end = other.span
    assert max(common_area(other, time) for time in np.arange(begin, end, 2.6)) < 0.03


def test_growth_ends_where_the_next_one_stands():
    queue = parked(*((4.3 * n, 0.0, 0.0, 0.0, 0.0) for n in range(30)))  # cars of 4 m with 30 cm between them
    found = finish(varied(queue, 2))
    fronts = np.array([4.3 * n + user.length / 2 for n, user in enumerate(found.users)])
    rears = np.array([4.3 * n - user.length / 2 for n, user in enumerate(found.users)])
    assert (rears[1:] - fronts[:-1]).min() > -0.015
    assert sizes(found)[:, 0].max() > 4.05
    assert sizes(found)[:, 0].min() < 3.9


def test_what_overlapped_before_is_left_alone():
    pair = parked((0.0, 0.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0, 0.0))
    assert finish(varied(pair, 4)).users[0].length != 4.0


def test_one_longer_than_all_kinds_keeps_its_size():
    tram = make_trajectories([(0.0, *([0.0] * 5))], users=[RoadUser("tram", "bus", 22.0, 2.4, 3.2)])
    (user,) = finish(varied(tram, 1)).users
    assert (user.length, user.width, user.height) == (22.0, 2.4, 3.2)
    assert any(user.shape)


def test_resized_dimensions_are_uniform_and_nested():
    users = many("car", 800)
    factors = {change: sizes(finish(resized(users, change, 9))) / sizes(users) - 1.0 for change in (0.05, 0.15)}
    assert np.abs(factors[0.15]).max() <= 0.151
    assert factors[0.15].std() == pytest.approx(0.15 / np.sqrt(3), rel=0.05)
    assert np.abs(np.corrcoef(factors[0.15].T)[np.triu_indices(3, 1)]).max() < 0.12
    np.testing.assert_allclose(factors[0.15], 3 * factors[0.05], atol=0.005)
    assert finish(resized(users, 0.0, 9)).users == users.users


def test_other_traffic_has_other_factors():
    one, other = many("car", 20), many("car", 21)
    factors = [sizes(finish(resized(users, 0.15, 9)))[:20] / sizes(users)[:20] for users in (one, other)]
    assert np.abs(np.corrcoef(*(part.ravel() for part in factors))[0, 1]) < 0.5


@pytest.mark.parametrize("change", [-0.1, 0.6, float("nan")])
def test_no_change_of_sizes_is_one_sentence(change):
    with pytest.raises(SeipError, match=r"sizes change by a share of 0 to 0\.5, not"):
        finish(resized(many("car", 2), change, 0))


def test_no_seed_is_one_sentence():
    with pytest.raises(SeipError, match="a seed of bodies is a whole number of 0 or more, not -1"):
        finish(varied(many("car", 2), -1))


def test_drawn_sizes_are_in_centimetres():
    random = np.random.default_rng(0)
    for category in CATEGORIES:
        drawn = [draw_size(category, random) for _ in range(20)]
        assert all(side == round(side, 2) > 0 for size in drawn for side in size)
        assert all(one != other for one, other in pairwise(drawn))
