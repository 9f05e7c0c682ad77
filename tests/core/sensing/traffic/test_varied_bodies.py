from dataclasses import replace
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from test_bodies import areas, edges, first_hit, parts, signed_volume

from seip_addon.core.errors import SeipError
from seip_addon.core.progress import finish
from seip_addon.core.sensing.traffic.bodies import MESHES, fitted_body, read_mesh
from seip_addon.core.sensing.traffic.trajectories import CATEGORIES, MAX_BEND, RoadUser, Trajectories, bent
from seip_addon.core.sensing.traffic.varied_bodies import KINDS, SHAPES, draw_shape, draw_size, resized, varied
from tests.builders.traffic_by_hand import make_trajectories, parked

SCENES = Path(__file__).parents[4] / "scenes"
RUNS = sorted(SCENES.glob("*_traffic*/run-*.npz"))
bend = st.tuples(st.floats(-1, 1), st.floats(-1, 1)).map(
    lambda pair: tuple(MAX_BEND * value / max(abs(pair[0]) + abs(pair[1]), 1.0) for value in pair)
)
within_range = st.sampled_from(CATEGORIES).flatmap(
    lambda category: st.builds(
        RoadUser,
        st.just("u"),
        st.just(category),
        st.floats(0.4, 20.0),
        st.floats(0.4, 3.0),
        st.floats(0.8, 4.0),
        st.just(0.5),
        st.tuples(*(st.floats(-most, most) for most in SHAPES[category])),
    )
)


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


@given(bend)
def test_bent_shares_keep_both_ends_and_their_order(shape):
    share = np.linspace(0.0, 1.0, 301)
    moved = bent(share, *shape)
    assert (moved[0], moved[-1]) == (0.0, 1.0)
    assert np.diff(moved).min() >= (1.0 - MAX_BEND) / 300 - 1e-12


@given(within_range)
def test_a_shaped_body_fills_its_box_exactly(user):
    triangles = fitted_body(user).triangles
    assert triangles.min(axis=(0, 1)).tolist() == [-user.length / 2, -user.width / 2, 0.0]
    assert triangles.max(axis=(0, 1)).tolist() == [user.length / 2, user.width / 2, user.height]


@pytest.mark.parametrize("path", sorted(MESHES.glob("*.obj")), ids=lambda path: path.stem)
def test_shaped_meshes_stay_closed_turned_outwards_and_their_panes_in_front(path):
    plain, _ = read_mesh(path)
    category, random = path.name.split(".")[0], np.random.default_rng(5)
    length, width, height = np.ptp(plain, axis=(0, 1)).tolist()
    own = fitted_body(RoadUser("u", category, length, width, height)).triangles
    before = np.cross(own[:, 1] - own[:, 0], own[:, 2] - own[:, 0])
    directed = edges(own)
    buried = panes = 0
    for _ in range(4):
        shape = draw_shape(category, random)
        triangles = fitted_body(RoadUser("u", category, length, width, height, shape=shape)).triangles
        assert len(edges(triangles)) == len(directed) == len(set(edges(triangles)))
        assert {(b, a) for a, b in edges(triangles)} == set(edges(triangles))
        after = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        turned = np.einsum("ij,ij->i", before, after) / np.linalg.norm(before, axis=1) / np.linalg.norm(after, axis=1)
        assert turned.min() > 0.9  # no face has turned by 26° or more
        assert areas(triangles).min() > 1e-4
        for part in parts(triangles):
            assert signed_volume(triangles[part]) > 0
            for front in part[:2] if len(part) == 6 else ():
                a, b, c = triangles[front]
                normal = np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a))
                panes += 1
                buried += first_hit(triangles, (a + b + c) / 3 + 0.05 * normal, -normal) != front
    assert buried <= 0.02 * panes


def test_a_shape_moves_the_foot_of_the_windscreen():
    def foot(shape):
        body = fitted_body(RoadUser("u", "car", 4.5, 1.8, 1.5, shape=shape))
        glass = body.triangles[body.material == "glass"]
        return glass[..., 0].max()

    assert foot((0.24, 0.0, 0.0, 0.0)) - foot((0.0,) * 4) == pytest.approx(0.2, abs=0.05)
    assert foot((-0.24, 0.0, 0.0, 0.0)) - foot((0.0,) * 4) == pytest.approx(-0.2, abs=0.05)


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


def test_what_has_no_shape_of_its_own_is_saved_as_before(tmp_path):
    run = Trajectories.load(RUNS[0])
    run.save(tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == RUNS[0].read_bytes()


@pytest.mark.parametrize("shape", [(0.1, 0.2, 0.3), (0.5, 0.2, 0.0, 0.0), (0.0, 0.0, 0.4, 0.4), ("a",) * 4, (0.1,) * 5])
def test_no_shape_is_one_sentence(tmp_path, shape):
    trajectories = parked((0.0, 0.0, 0.0, 0.0, 0.0))
    path = tmp_path / "run.npz"
    replace(trajectories, users=(replace(trajectories.users[0], shape=shape),)).save(path)
    with pytest.raises(SeipError, match="the shape of road user 'car 0' is"):
        Trajectories.load(path)


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
