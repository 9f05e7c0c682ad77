"""Whether a point lies inside a mesh is told quickly, and as its winding number has it."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from seip_addon.core.geometry.winding_number import Blocks, enclosed
from seip_addon.core.site.obstruction import inside_any, post_blocked
from seip_addon.core.site.scene_geometry import Mesh
from tests.oracles.random_cases import cases
from tests.oracles.winding_number import winding_number

TETRAHEDRON = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)], dtype=float)
FACES = np.array([(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)])


def finer(triangles, times=1):
    """Each triangle cut into four, so many times."""
    for _ in range(times):
        a, b, c = np.moveaxis(triangles, 1, 0)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        parts = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        triangles = np.concatenate([np.stack(part, axis=1) for part in parts])
    return triangles


def solids(random, count, times, lost=0.0):
    """Tetrahedra set at random, cut fine, of whose triangles some are lost."""
    size, place = random.uniform(1, 6, (count, 1, 1)), random.uniform(-30, 30, (count, 1, 3))
    fine = finer((TETRAHEDRON * size + place)[:, FACES].reshape(-1, 3, 3), times)
    return fine[random.random(len(fine)) >= lost]


def sheet(times):
    """A square of 60 m, nearly seen as the half of the world from above its middle."""
    a, b, c, d = np.array([(-30, -30, 0), (30, -30, 0), (30, 30, 0), (-30, 30, 0)], dtype=float)
    return finer(np.array([[a, b, c], [a, c, d]]), times)


def leaves(random, count):
    """Small triangles, none of which touches another."""
    return random.uniform(-30, 30, (count, 1, 3)) + random.normal(0, 0.5, (count, 3, 3))


@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 20),
    times=st.integers(0, 3),
    lost=st.sampled_from([0.0, 0.3]),
    shift=st.sampled_from([0.0, 1e4]),
)
@settings(max_examples=12)
def test_it_is_what_the_winding_number_says(seed, count, times, lost, shift):
    random = np.random.default_rng(seed)
    triangles = np.concatenate([solids(random, count, times, lost), leaves(random, count), sheet(times)]) + shift
    points = random.uniform(-30, 30, (60, 3)) + shift
    number = np.abs(winding_number(points, triangles))
    clear = np.abs(number - 0.5) > 1e-9
    assert (enclosed(points, triangles) == (number > 0.5))[clear].all()


@given(seed=st.integers(0, 2**32 - 1), tolerance=st.sampled_from([1.0, 0.1, 0.01]))
@settings(max_examples=12)
def test_no_error_is_above_its_bound(seed, tolerance):
    random = np.random.default_rng(seed)
    triangles = np.concatenate([solids(random, 10, 3, 0.3), leaves(random, 500), sheet(5)])
    points = random.uniform(-40, 40, (25, 3))
    blocks = Blocks.of(triangles)
    found, bound = np.transpose([blocks.winding_number(point, tolerance) for point in points])
    assert (np.abs(found - winding_number(points, triangles)) <= bound + 1e-9).all()
    assert bound.max() > 0


def test_a_point_in_doubt_is_told_by_all_triangles():
    triangles = sheet(6)
    points = np.array([(0.1, 0.2, 1e-7), (0.1, 0.2, -1e-7), (0.1, 0.2, 30.0)])
    assert (enclosed(points, triangles) == (np.abs(winding_number(points, triangles)) > 0.5)).all()


@pytest.mark.parametrize("count", [0, 1, 32, 33, 257])
def test_any_number_of_triangles_can_be_asked(count):
    triangles = leaves(np.random.default_rng(0), count)
    assert not enclosed(np.zeros((2, 3)), triangles).any()
    assert enclosed(np.empty((0, 3)), triangles).shape == (0,)


def test_triangles_in_one_place_do_no_harm():
    ball = np.concatenate([TETRAHEDRON[FACES], np.zeros((500, 3, 3))])
    assert enclosed(np.array([(0.1, 0.0, 0.0), (3.0, 0.0, 0.0)]), ball).tolist() == [True, False]
    assert not enclosed(np.array([(0.1, 0.0, 0.0)]), np.zeros((500, 3, 3))).any()


@given(seed=st.integers(0, 2**32 - 1), clearance=st.sampled_from([0.0, 0.3, 2.0]))
@cases(30)
def test_a_post_is_blocked_by_what_comes_too_near_in_plan_at_its_height(seed, clearance):
    random = np.random.default_rng(seed)
    triangles = np.concatenate([solids(random, 6, 1), leaves(random, 40)])
    foot, height = random.uniform(-30, 30, (30, 3)), random.uniform(1, 10, 30)
    shadow = shapely.convex_hull(shapely.multipoints(shapely.points(triangles[:, :, :2])))
    near = shapely.dwithin(shadow, shapely.points(foot[:, :2])[:, None], clearance)
    low, high = triangles[:, :, 2].min(axis=1), triangles[:, :, 2].max(axis=1)
    meets = (low < (foot[:, 2] + height)[:, None] + clearance) & (high > foot[:, 2:] + 0.3)
    halves = (Mesh("a", triangles[:30]), Mesh("b", triangles[30:]))
    assert post_blocked(foot, height, clearance, halves).tolist() == (near & meets).any(axis=1).tolist()


@pytest.mark.long
def test_a_million_triangles_may_be_one_object_or_many():
    """Posts among 250 solids of 4096 triangles each that stand apart, so that each is inside of one or of none."""
    places = np.stack(np.meshgrid(np.arange(25.0) * 12, np.arange(10.0) * 12, [2.0], indexing="ij"), axis=-1)
    size = np.linspace(2, 5, 250)[:, None, None]
    corners = TETRAHEDRON * size + places.reshape(-1, 1, 3)
    parts = [finer(each[FACES], 5) for each in corners]
    one, many = (Mesh("all", np.concatenate(parts)),), tuple(Mesh(f"{i}", part) for i, part in enumerate(parts))
    assert len(one[0].triangles) > 1_000_000
    random = np.random.default_rng(0)
    foot = random.uniform((-5, -5, 0), (300, 120, 0), (300, 3))
    points = np.concatenate([foot + np.array((0, 0, height)) for height in (3.5, 5.4, 8.0)])
    inside = inside_any(points, one)
    normals = np.cross(
        corners[:, FACES][:, :, 1] - corners[:, FACES][:, :, 0], corners[:, FACES][:, :, 2] - corners[:, FACES][:, :, 0]
    )
    beyond = np.einsum("sfk,psfk->psf", normals, points[:, None, None] - corners[None][:, :, FACES[:, 0]])
    assert inside.tolist() == (beyond < 0).all(axis=2).any(axis=1).tolist()
    assert 10 < inside.sum() < 890
    assert inside.tolist() == inside_any(points, many).tolist()
    height = np.full(300, 5.4)
    blocked = post_blocked(foot, height, 0.3, one)
    assert blocked.tolist() == post_blocked(foot, height, 0.3, many).tolist()
    assert 10 < blocked.sum() < 290


def test_winding_number_tells_inside_whatever_the_normals():
    points = np.array([(0.0, 0.0, 0.0), (1.5, 0.5, 0.5), (0.3, 0.1, 0.2)])
    ball = TETRAHEDRON[FACES]
    np.testing.assert_allclose(np.abs(winding_number(points, ball)), [1, 0, 1], atol=1e-12)
    np.testing.assert_allclose(np.abs(winding_number(points, ball[:, ::-1])), [1, 0, 1], atol=1e-12)
