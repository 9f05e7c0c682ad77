"""Expected returns against an oracle that casts every ray by itself, and against scans of bodies."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.lidar.range_equation import RangeEquation
from seip_addon.core.sensing.returns.bodies import PANELS
from seip_addon.core.sensing.returns.expected_returns import upright_returns
from seip_addon.core.sensing.returns.occlusion import HIDING, clear_chance, returns_in_traffic
from seip_addon.core.sensing.returns.road_users import BODIES, RoadUsers
from seip_addon.core.sensing.traffic import vehicle_types
from seip_addon.core.sensing.traffic.bodies import fitted_body
from seip_addon.core.sensing.traffic.trajectories import RoadUser
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from tests.builders.traffic_by_hand import make_model


def model_of(elevations_deg, steps, offsets=None, view=360.0, most=60.0):
    return make_model(
        elevations=np.radians(elevations_deg),
        azimuth_offsets=np.zeros(0) if offsets is None else np.radians(offsets),
        field_of_view=math.radians(view),
        min_range=0.5,
        max_range=most,
        points_per_second=10.0 * steps * len(elevations_deg),
        law=RangeEquation.of_ranges(30.0, 80.0),
    )


def users_at(points, bodies):
    count = len(points)
    return RoadUsers(
        np.array(points, dtype=float).reshape(-1, 3),
        np.array(bodies, dtype=np.int64),
        np.ones(count),
        np.zeros(count, bool),
        np.full(count, -1),
        (),
    )


def box(low, high):
    """Triangles of an upright box, from its corners."""
    x, y, z = (np.array([low[axis], high[axis]], dtype=float) for axis in range(3))
    corner = lambda i, j, k: [x[i], y[j], z[k]]  # noqa: E731
    quads = [
        [corner(0, 0, k) for k in (0, 1)] + [corner(0, 1, k) for k in (1, 0)],
        [corner(1, 0, k) for k in (0, 1)] + [corner(1, 1, k) for k in (1, 0)],
        [corner(0, 0, k) for k in (0, 1)] + [corner(1, 0, k) for k in (1, 0)],
        [corner(0, 1, k) for k in (0, 1)] + [corner(1, 1, k) for k in (1, 0)],
        [corner(0, 0, 1), corner(1, 0, 1), corner(1, 1, 1), corner(0, 1, 1)],
    ]
    return np.array([[q[0], q[1], q[2]] for q in quads] + [[q[0], q[2], q[3]] for q in quads])


def hit_distance(origin, direction, triangles):
    """Distance to the first triangle by Cramer's rule, one triangle after another."""
    nearest = math.inf
    for a, b, c in triangles:
        matrix = np.column_stack([b - a, c - a, -direction])
        if abs(np.linalg.det(matrix)) < 1e-12:
            continue
        u, v, distance = np.linalg.solve(matrix, origin - a)
        if u >= 0 and v >= 0 and u + v <= 1 and 0 < distance < nearest:
            nearest = distance
    return nearest


def law_of(model, distance, reflected):
    """Probability of detection by the range equation, from its formula."""
    law = model.law
    power = math.log(reflected * math.exp(-2 * law.extinction * distance) / distance**2)
    return law.ceiling * 0.5 * math.erfc(-(power - law.threshold) / law.spread / math.sqrt(2))


def returns_ray_by_ray(origin, yaw, model, users, triangles):
    expected = np.zeros(len(users))
    for channel in range(model.channels):
        for step in range(model.azimuth_count):
            azimuth = yaw + model.azimuth_offsets[channel] + model.first_azimuth + step * model.azimuth_step
            elevation = model.elevations[channel]
            direction = np.array(
                [
                    math.cos(azimuth) * math.cos(elevation),
                    math.sin(azimuth) * math.cos(elevation),
                    math.sin(elevation),
                ]
            )
            stop = None
            for number in range(len(users)):
                panel = PANELS[BODIES[users.body[number]]]
                x, y, z = users.xyz[number] - origin
                away = max(math.hypot(x, y), panel.width / 2)
                turn = (azimuth - math.atan2(y, x) + math.pi) % math.tau - math.pi
                height = away * math.tan(elevation)
                if abs(turn) > math.asin(panel.width / 2 / away) or not z <= height <= z + panel.height:
                    continue
                stop = hit_distance(origin, direction, triangles) if stop is None else stop
                distance = away / math.cos(elevation)
                if stop * math.cos(elevation) >= away and model.min_range <= distance <= model.max_range:
                    expected[number] += law_of(model, distance, panel.reflected * math.cos(elevation))
    return expected


@st.composite
def sites(draw):
    number = st.floats(-14.0, 14.0, allow_nan=False).map(lambda value: round(value, 3))
    count = draw(st.integers(1, 6))
    points = [(draw(number), draw(number), 0.0) for _ in range(count)]
    bodies = [draw(st.integers(0, 2)) for _ in range(count)]
    walls = [np.zeros((0, 3, 3))]
    for _ in range(draw(st.integers(0, 2))):
        x, y = draw(number), draw(number)
        walls.append(box((x, y, 0.0), (x + 2.3, y + 1.1, draw(st.floats(0.4, 3.0)))))
    ground = np.array([[[-40, -40, 0], [40, -40, 0], [40, 40, 0]], [[-40, -40, 0], [40, 40, 0], [-40, 40, 0]]], float)
    return points, bodies, np.concatenate([ground - [0, 0, 0.01], *walls])


@settings(max_examples=60, deadline=None)
@given(
    sites(),
    st.floats(0.0, 6.2),
    st.sampled_from([360.0, 120.0]),
    st.lists(st.floats(-20.0, 20.0), min_size=4, max_size=4),
)
def test_returns_equal_those_of_every_ray_by_itself(site, yaw, view, offsets):
    points, bodies, triangles = site
    model = model_of([-35.3, -14.2, -6.1, -2.3], 90, offsets, view)
    users = users_at(points, bodies)
    origin = np.array([0.137, -0.219, 3.417])
    found, _ = upright_returns(make_ray_caster(triangles, "embree"), origin, yaw, model, users)
    np.testing.assert_allclose(found, returns_ray_by_ray(origin, yaw, model, users, triangles), rtol=2e-6, atol=2e-6)


def test_a_wall_hides_and_a_low_one_hides_in_part():
    model = load_catalogue(())["os1_128"]
    users = users_at([(20.0, 0.0, 0.0)], [0])
    origin = np.array([0.0, 0.0, 4.0])
    returns = [
        upright_returns(
            make_ray_caster(box((14.0, -5.0, 0.0), (15.0, 5.0, height)), "embree"), origin, 0.0, model, users
        )
        for height in (0.1, 1.6, 5.0)
    ]
    free, partly, hidden = (float(found[0][0]) for found in returns)
    assert free > partly > hidden == 0.0


@pytest.mark.parametrize("name", BODIES)
def test_panels_have_the_silhouette_and_the_reflection_of_the_bodies_that_scans_have(name):

    kinds = {"car": "DEFAULT_VEHTYPE", "cyclist": "DEFAULT_BIKETYPE", "pedestrian": "DEFAULT_PEDTYPE"}
    kind = vehicle_types.BUILT_IN[kinds[name]]
    body = fitted_body(RoadUser("one", kind.category, kind.length, kind.width, kind.height))
    normal = np.cross(body.triangles[:, 1] - body.triangles[:, 0], body.triangles[:, 2] - body.triangles[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    caster, side = make_ray_caster(body.triangles, "embree"), 0.03
    across, up = (grid.ravel() for grid in np.meshgrid(np.arange(-3, 3, side), np.arange(0, kind.height, side)))
    areas, reflected = [], []
    for heading in np.arange(32) * math.tau / 32:
        toward = np.array([math.cos(heading), math.sin(heading), 0.0])
        right = np.array([-toward[1], toward[0], 0.0])
        starts = -20 * toward + across[:, None] * right + up[:, None] * [0, 0, 1]
        _, triangle = caster.cast(starts, np.broadcast_to(toward, starts.shape).copy(), 60.0)
        hit = triangle[triangle >= 0]
        areas.append(len(hit) * side**2)
        reflected.append((body.reflectivity[hit] * np.abs(normal[hit] @ toward)).mean())
    panel = PANELS[name]
    assert panel.height == kind.height
    assert panel.width * panel.height == pytest.approx(np.mean(areas), rel=0.04)
    assert panel.reflected == pytest.approx(np.mean(reflected), rel=0.04)


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
