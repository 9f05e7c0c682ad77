"""Dropping triangles changes nothing, and drops what stands nowhere near."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.visibility.settings import Engine
from seip_addon.core.sensing.visibility.triangle_culling import culling_message, needed_triangles
from tests.engines import each_engine
from tests.oracles.random_cases import cases


@each_engine
@cases(40)
@given(st.integers(0, 2**32 - 1))
def test_no_line_of_sight_changes(engine: Engine, seed: int) -> None:
    random = np.random.default_rng(seed)
    triangles = random.uniform((-60, -60, -4), (60, 60, 12), (300, 1, 3)) + random.normal(0, 2, (300, 3, 3))
    poses = random.uniform((-25, -10, 3), (25, 10, 6), (6, 3))
    targets = random.uniform((-25, -10, -0.5), (25, 10, 0.5), (60, 3))
    needed = needed_triangles(triangles, poses, targets, 1.0, 30.0)
    assert 0 < needed.counts["kept"] < 300
    whole, part = make_ray_caster(triangles, engine), make_ray_caster(triangles, engine, needed.keep)
    for pose in poses:
        ends = targets + random.uniform(-0.5, 0.5, targets.shape)
        rays = (ends - pose) / np.linalg.norm(ends - pose, axis=1, keepdims=True)
        reach = np.linalg.norm(ends - pose, axis=1)
        before, after = whole.cast(pose, rays, 30.0), part.cast(pose, rays, 30.0)
        short = before[0] <= reach
        assert (before[0][short] == after[0][short]).all()
        assert (before[1][short] == after[1][short]).all()
        assert (after[0][~short] >= before[0][~short]).all()


def test_each_reason_is_counted_and_said() -> None:
    upright = np.array([[0.0, 0, 0], [0, 1, 0], [0, 0, 1]])
    poses, targets = np.array([[0.0, 0, 5]]), np.array([[40.0, 0, 0]])
    places = [(20, 0, 1), (20, 0, 6), (20, 0, -4), (20, 9, 1), (35, 0, 0)]
    triangles = np.array([upright + place for place in places] + [np.zeros((3, 3))])
    needed = needed_triangles(triangles, poses, targets, 1.0, 30.0)
    assert needed.keep.tolist() == [True, False, False, False, False, False]
    reasons = {"without_area": 1, "above": 1, "below": 1, "beside": 1, "out_of_range": 1}
    assert needed.counts == {"all": 6, "kept": 1} | reasons
    sentence = culling_message(needed.counts)
    assert sentence.startswith("rays are cast against 1 of 6 triangles; dropped: 1 without area, 1 above")
