from headless.studies.random_sites.varied_bodies import SHAPES, draw_shape

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.traffic.bodies import (
    MESHES,
    REFLECTIVITY,
    fitted_body,
    read_mesh,
)
from seip_addon.core.sensing.traffic.trajectories import CATEGORIES, RoadUser

USUAL = {
    "hatchback": ("car", 3.9, 1.75, 1.48),
    "saloon": ("car", 4.75, 1.83, 1.45),
    "SUV": ("car", 4.6, 1.88, 1.68),
    "SUMO's own car": ("car", 5.0, 1.8, 1.5),
    "small van": ("van", 4.5, 1.85, 1.85),
    "large van": ("van", 5.9, 2.0, 2.6),
    "light truck": ("truck", 7.1, 2.4, 2.4),
    "rigid truck": ("truck", 9.5, 2.5, 3.6),
    "semi-trailer": ("truck", 16.5, 2.55, 4.0),
    "bus": ("bus", 12.0, 2.5, 3.2),
    "long bus": ("bus", 18.0, 2.55, 3.2),
    "motorcycle": ("motorcycle", 2.2, 0.9, 1.5),
    "bicycle": ("bicycle", 1.75, 0.65, 1.75),
    "pedestrian": ("pedestrian", 0.6, 0.55, 1.78),
    "SUMO's own pedestrian": ("pedestrian", 0.215, 0.478, 1.719),
}
usual = pytest.mark.parametrize("user", [RoadUser(name, *given) for name, given in USUAL.items()], ids=list(USUAL))


def parts(triangles):
    """Numbers of the triangles of each connected part, by shared corners."""
    vertices, corners = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    label = np.arange(len(vertices))
    corners = corners.reshape(-1, 3)
    while True:
        lowest = label[corners].min(axis=1)
        spread = label.copy()
        np.minimum.at(spread, corners.ravel(), np.repeat(lowest, 3))
        if (spread == label).all():
            break
        label = spread
    part = label[corners[:, 0]]
    return [np.flatnonzero(part == number) for number in np.unique(part)]


def edges(triangles):
    _, corners = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    corners = corners.reshape(-1, 3)
    return [tuple(edge) for i in range(3) for edge in corners[:, [i, (i + 1) % 3]].tolist()]


def signed_volume(triangles):
    """Volume that closed triangles enclose, below zero where they are inside out."""
    inner = triangles - triangles[0, 0]
    return np.einsum("ij,ij->", inner[:, 0], np.cross(inner[:, 1], inner[:, 2])) / 6


def areas(triangles):
    return np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1) / 2


def first_hit(triangles, start, direction):
    """Number of the first triangle that a ray meets (Möller and Trumbore 1997)."""
    a, b, c = triangles.transpose(1, 0, 2)
    along, across = b - a, c - a
    p = np.cross(direction, across)
    determinant = (along * p).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = ((start - a) * p).sum(axis=1) / determinant
        q = np.cross(start - a, along)
        v = (q @ direction) / determinant
        distance = (across * q).sum(axis=1) / determinant
        met = (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0)
    return int(np.argmin(np.where(met, distance, np.inf))) if met.any() else None


TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl {material}\nf 1 3 2\nf 1/1/1 2/2/2 4/3/3\nf 2 3 4\nf 1 4 3\n"


def test_a_mesh_is_read_as_blender_writes_it(tmp_path):
    path = tmp_path / "car.mine.obj"
    path.write_text("mtllib mine.mtl\no Body\ns 0\n" + TETRAHEDRON.format(material="tail_lamp"))
    triangles, material = read_mesh(path)
    assert triangles[0].tolist() == [[0, 0, 0], [0, 1, 0], [1, 0, 0]]
    assert material.tolist() == ["tail lamp"] * 4


@usual
def test_a_body_has_few_triangles_and_none_without_area(user):
    body = fitted_body(user)
    assert 60 <= len(body) <= 300
    assert areas(body.triangles).min() > 1e-4
    assert len(body) == len(body.reflectivity) == len(body.material)


@pytest.mark.parametrize(
    ("name", "low", "high"), [("saloon", 0.08, 0.2), ("bus", 0.2, 0.4), ("semi-trailer", 0.02, 0.1)]
)
def test_so_much_is_glass(name, low, high):
    body = fitted_body(RoadUser(name, *USUAL[name]))
    area = areas(body.triangles)
    assert low < area[body.material == "glass"].sum() / area.sum() < high
    assert set(body.reflectivity[body.material == "glass"]) == {0.05}


def test_rays_from_ahead_and_aside_meet_glass_over_paint():
    user = RoadUser("u", *USUAL["saloon"], paint=0.65)
    body = fitted_body(user)

    def seen(start, direction):
        return str(body.material[first_hit(body.triangles, np.array(start), np.array(direction))])

    back, right, left, on = (-1.0, 0.001, 0.0), (0.0, -1.0, 0.001), (0.0, 1.0, 0.001), (1.0, 0.001, 0.0)
    assert seen((10.0, 0.2, 1.20), back) == "glass"
    assert seen((-10.0, 0.2, 1.15), on) == "glass"
    assert seen((0.45, 10.0, 1.10), right) == "glass"
    assert seen((0.45, -10.0, 1.10), left) == "glass"
    assert seen((0.2, 10.0, 0.60), right) == "paint silver"
    assert seen((10.0, 0.6, 0.65), back) == "headlamp"
    assert seen((-10.0, 0.65, 0.80), on) == "tail lamp"
    assert seen((1.49, 10.0, 0.07), right) == "tyre"


@usual
def test_no_pane_lies_buried_in_what_carries_it(user):
    body = fitted_body(user)
    panes = [part for part in parts(body.triangles) if len(part) == 6]  # two triangles in front, four to the hidden tip
    assert panes or user.category in {"bicycle", "pedestrian"}
    for front in np.concatenate([pane[:2] for pane in panes] or [np.zeros(0, int)]):
        a, b, c = body.triangles[front]
        normal = np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a))
        outside = (a + b + c) / 3 + 0.05 * normal
        assert first_hit(body.triangles, outside, -normal) == front


@usual
def test_paint_and_clothes_have_the_users_reflectivity(user):
    painted = fitted_body(RoadUser(**{**vars(user), "paint": 0.3}))
    for name, reflectivity in zip(painted.material.tolist(), painted.reflectivity, strict=True):
        assert reflectivity == (0.3 if name in {"paint green", "cloth green"} else REFLECTIVITY[name])


@pytest.mark.parametrize(
    "size", [(0.0, 1.8, 1.5), (4.5, -1.0, 1.5), (4.5, 1.8, float("nan")), (float("inf"), 1.8, 1.5)]
)
def test_no_size_is_one_sentence(size):
    with pytest.raises(SeipError, match=r"road user 'a' is .* m large; give its type"):
        fitted_body(RoadUser("a", "car", *size))


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
@example(RoadUser("u", "car", 4.5, 1.8, 1.5))
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
