"""Both engines against plain float64 arithmetic."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.visibility.ray_casting import BvhRayCaster, EmbreeRayCaster, make_ray_caster
from tests.engines import each_engine
from tests.oracles.float64_rays import first_hits

SQUARE = np.array([[[-1, -1, 5], [1, -1, 5], [1, 1, 5]], [[-1, -1, 5], [1, 1, 5], [-1, 1, 5]]], dtype=np.float64)
UP = np.array([[0.0, 0.0, 1.0]])


def unit(random, count):
    rays = random.normal(size=(count, 3))
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


@each_engine
def test_hit_miss_and_reach(engine):
    caster = make_ray_caster(SQUARE, engine)
    assert type(caster) is {"bvh": BvhRayCaster, "embree": EmbreeRayCaster}[engine]
    towards_corner = np.array([0.5, -0.25, 5.0]) / np.linalg.norm([0.5, -0.25, 5.0])
    distance, triangle = caster.cast(np.zeros(3), np.stack([towards_corner, -UP[0]]), 100.0)
    assert distance.tolist() == pytest.approx([np.linalg.norm([0.5, -0.25, 5.0]), np.inf], rel=1e-6)
    assert triangle.tolist() == [0, -1]
    distance, triangle = caster.cast(np.zeros(3), towards_corner[None], 5.0)
    assert (distance[0], triangle[0]) == (np.inf, -1)


@each_engine
def test_map_coordinates_lose_nothing(engine):
    random = np.random.default_rng(3)
    triangles = random.uniform(-40, 40, (300, 1, 3)) + random.normal(0, 3, (300, 3, 3))
    rays = unit(random, 2000)
    here, which = make_ray_caster(triangles, engine).cast(np.zeros(3), rays, 100.0)
    far = np.array([5e6, -5e6, 100.0])
    there, which_there = make_ray_caster(triangles + far, engine).cast(far, rays, 100.0)
    assert (which == which_there).mean() > 0.999  # an edge may flip
    same = (which == which_there) & (which >= 0)
    np.testing.assert_allclose(here[same], there[same], atol=1e-4)


@each_engine
@given(seed=st.integers(0, 2**32 - 1))
def test_hits_are_those_of_float64_arithmetic(engine, seed):
    random = np.random.default_rng(seed)
    triangles = random.uniform(-20, 20, (60, 1, 3)) + random.normal(0, 4, (60, 3, 3))
    rays = unit(random, 400)
    expected = first_hits(np.zeros(3), rays, triangles)
    distance, triangle = make_ray_caster(triangles, engine).cast(np.zeros(3), rays, 1000.0)
    agree = np.isclose(distance, expected, rtol=0, atol=1e-3)
    assert agree.sum() >= 398  # float32 may decide an edge the other way
    assert ((triangle >= 0) == np.isfinite(distance)).all()


@each_engine
def test_a_hit_is_the_same_whatever_else_is_cast_and_however_far_the_ray_goes(engine):
    random = np.random.default_rng(6)
    triangles = random.uniform(-20, 20, (500, 1, 3)) + random.normal(0, 2, (500, 3, 3))
    rays = unit(random, 1000)
    caster = make_ray_caster(triangles, engine)
    distance, triangle = caster.cast(np.zeros(3), rays, 100.0)
    pick = random.permutation(1000)[:137]
    part = caster.cast(np.zeros(3), rays[pick], 100.0)
    assert (part[0] == distance[pick]).all()
    assert (part[1] == triangle[pick]).all()
    reach = float(np.median(distance[triangle >= 0]))
    short = caster.cast(np.zeros(3), rays, reach)
    assert (short[0] == np.where(distance <= reach, distance, np.inf)).all()


def test_an_unknown_engine_names_the_known():
    with pytest.raises(SeipError, match="auto, bvh or embree"):
        make_ray_caster(SQUARE, "optix")  # type: ignore[arg-type]
