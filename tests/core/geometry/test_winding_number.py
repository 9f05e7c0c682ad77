"""Whether a point lies inside a mesh is told quickly, and as its winding number has it."""

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from seip_addon.core.geometry.winding_number import _shares, enclosed
from seip_addon.core.site.obstruction import post_blocked
from seip_addon.core.site.scene_geometry import Mesh
from tests.oracles.random_cases import cases


def winding_number(points, triangles):
    """Return the winding number (n,) of points (n, 3) in a triangle soup (m, 3, 3)."""
    numbers = [_shares(triangles - point).sum() for point in points]
    return np.array(numbers, dtype=np.float64)


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
