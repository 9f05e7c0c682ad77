"""Shapes of bodies: a body of any shape fills its box, and a run keeps the shapes of its road users."""

from headless.studies.random_sites.varied_bodies import SHAPES, draw_shape

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_bodies import areas, edges, first_hit, parts, signed_volume

from seip_addon.core.sensing.traffic.bodies import MESHES, fitted_body, read_mesh
from seip_addon.core.sensing.traffic.trajectories import CATEGORIES, RoadUser

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
