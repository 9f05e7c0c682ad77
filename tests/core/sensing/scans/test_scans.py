"""Scans of traffic against worked examples, and against casting every ray at everything."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path

from headless.studies.benchmark.scans import SLACK, combined, differing, full_scan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.arrays import Float
from seip_addon.core.base.progress import finish
from seip_addon.core.geometry.orientation import rotations
from seip_addon.core.sensing.lidar.carla_dropoff import CarlaDropoff
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scans.beam_culling import rays_towards
from seip_addon.core.sensing.scans.frame import STATIC_INSTANCE, Frame, Labels
from seip_addon.core.sensing.scans.sensor import MountedSensor, level_orientation
from seip_addon.core.sensing.scans.simulation import ScanSettings, Simulation, prepare
from seip_addon.core.sensing.scans.static_scene import static_scene
from seip_addon.core.sensing.traffic.trajectories import RoadUser
from seip_addon.core.site.scene_geometry import Mesh, SceneGeometry
from tests.builders.small_junction import box_triangles
from tests.builders.traffic_by_hand import (
    box_body,
    ground,
    make_model,
    make_sensor,
    make_static,
    make_trajectories,
    parked,
)
from tests.engines import ANY, each_engine, needs_any
from tests.oracles.float64_rays import first_hits
from tests.oracles.random_cases import cases


def grazes(origin: Float, direction: Float, triangles: Float, distance: float) -> bool:
    """Return whether a ray grazes an edge or a surface, so that two engines may disagree on it.

    It passes an edge, or it hits a surface so edge-on that the single precision of the
    corners moves the full scan's return, while double precision agrees with this one.
    """
    return (
        passes_an_edge(origin, direction, triangles) or abs(exact_hit(origin, direction, triangles) - distance) < SLACK
    )


def exact_hit(origin: Float, direction: Float, triangles: Float) -> float:
    """Return the distance to the first triangle in double precision (Möller and Trumbore 1997), or infinity."""
    start, first, second = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    across = np.cross(direction, second)
    volume = (first * across).sum(axis=1)
    facing = np.flatnonzero(volume)
    away, share = origin - start[facing], 1.0 / volume[facing]
    along = np.cross(away, first[facing])
    u, v = share * (away * across[facing]).sum(axis=1), share * (along @ direction)
    far = share * (second[facing] * along).sum(axis=1)
    return float(far[(u >= 0) & (v >= 0) & (u + v <= 1) & (far > 0)].min(initial=np.inf))


def passes_an_edge(origin: Float, direction: Float, triangles: Float) -> bool:
    """Return whether a ray passes within `SLACK` of a triangle's edge."""
    start = np.concatenate([triangles[:, corner] for corner in range(3)]) - origin
    edge = np.concatenate([triangles[:, (corner + 1) % 3] - triangles[:, corner] for corner in range(3)])
    aside, across = (part - np.outer(part @ direction, direction) for part in (start, edge))
    length = np.maximum((across**2).sum(axis=1), np.finfo(float).tiny)
    share = np.clip(-(aside * across).sum(axis=1) / length, 0, 1)
    return bool(np.linalg.norm(aside + share[:, None] * across, axis=1).min() < SLACK)


pytestmark = needs_any

EXACT = ScanSettings(noise=False, engine=ANY)
NOISY = ScanSettings(seed=5, engine=ANY)
ONE_RAY = {"elevations": np.zeros(1), "points_per_second": 10.0}


def simulation(static, sensors, trajectories, scan_settings=EXACT, reflectivity=0.5) -> Simulation:
    bodies = [box_body(user, reflectivity) for user in trajectories.users]
    return finish(prepare(static, sensors, trajectories, bodies, scan_settings))


def same(one: Frame, other: Frame) -> bool:
    pairs = [(getattr(one, part.name), getattr(other, part.name)) for part in fields(Frame) if part.name != "labels"]
    pairs += [(getattr(one.labels, part.name), getattr(other.labels, part.name)) for part in fields(Labels)]
    return all(np.array_equal(a, b) and np.asarray(a).dtype == np.asarray(b).dtype for a, b in pairs)


@each_engine
def test_a_box_before_the_sensor_returns_what_the_formula_says(engine) -> None:
    sensor = make_sensor((1.0, 0.0, 1.0), **ONE_RAY)
    frame = simulation(
        make_static(), [sensor], parked((12.0, 0.0, 0.0, 0.0, 0.0)), replace(EXACT, engine=engine)
    ).frame(0, 0.0)
    np.testing.assert_allclose(frame.points, [[10.0, 0.0, 1.0]], atol=1e-6)
    assert frame.instance.tolist() == [0]
    assert frame.sensor.tolist() == frame.delay.tolist() == [0]
    assert frame.intensity[0] == pytest.approx(0.5 * math.exp(-0.01 * 9.0), rel=1e-5)
    labels = frame.labels
    assert (labels.user.tolist(), labels.category.tolist(), labels.points.tolist()) == ([0], ["car"], [[1]])
    np.testing.assert_allclose(labels.centre, [[12.0, 0.0, 0.75]])
    assert labels.size.tolist() == [[4.0, 2.0, 1.5]]
    assert (labels.visibility.tolist(), labels.speed.tolist(), labels.inside.tolist()) == ([1.0], [3.0], [True])


def test_a_sloping_face_returns_less_by_the_cosine() -> None:
    sensor = make_sensor((0.0, 0.0, 0.75), **ONE_RAY)
    frame = simulation(make_static(), [sensor], parked((10.0, 0.2, 0.0, math.radians(30.0), 0.0))).frame(0, 0.0)
    distance = float(np.linalg.norm(frame.points[0] - sensor.xyz))
    assert frame.intensity[0] == pytest.approx(0.5 * math.cos(math.radians(30)) * math.exp(-0.01 * distance), rel=1e-5)


def test_what_is_out_of_range_stops_rays_without_a_return() -> None:
    sensor = make_sensor((0.0, 0.0, 0.75), **ONE_RAY, min_range=9.0, max_range=20.0)
    wall = box_triangles((15.0, -5.0, 0.0), (16.0, 5.0, 5.0))
    near = simulation(make_static(wall), [sensor], parked((6.0, 0.0, 0.0, 0.0, 0.0))).frame(0, 0.0)
    assert (len(near), near.labels.visibility.tolist()) == (0, [0.0])
    clear = simulation(make_static(wall), [sensor], parked((12.0, 0.0, 0.0, 0.0, 0.0))).frame(0, 0.0)
    assert clear.points[0, 0] == pytest.approx(10.0)
    beyond = simulation(make_static(), [sensor], parked((30.0, 0.0, 0.0, 0.0, 0.0))).frame(0, 0.0)
    assert len(beyond) == 0


def test_visibility_is_the_share_of_rays_that_get_through() -> None:
    """One level channel, a degree from ray to ray; a wall hides all to the left of straight ahead."""
    sensor = make_sensor((0.0, 0.0, 1.0), elevations=np.zeros(1), points_per_second=3600.0)
    cars = parked((22.0, 0.0, 0.0, 0.0, 0.0), (-22.0, 0.0, 0.0, math.pi, 0.0), (0.0, 50.0, 0.0, 0.0, 0.0))
    wall = box_triangles((10.0, 0.05, 0.0), (10.5, 3.0, 4.0))
    front = math.floor(math.degrees(math.atan2(1.0, 20.0)))
    labels = simulation(make_static(wall), [sensor], cars).frame(0, 0.0).labels
    assert labels.points[:, 0].tolist() == [front + 1, 2 * front + 1, labels.points[2, 0]]
    np.testing.assert_allclose(labels.visibility[:2], [(front + 1) / (2 * front + 1), 1.0])
    assert labels.yaw.tolist() == [0.0, -math.pi, 0.0]
    assert labels.inside.tolist() == [True, True, False]


def test_a_box_on_a_slope_has_its_middle_over_its_underside() -> None:
    labels = simulation(make_static(), [make_sensor()], parked((10.0, 0.0, 1.0, math.pi / 2, 0.1))).frame(0, 0.0).labels
    np.testing.assert_allclose(labels.centre, [[10.0, -0.75 * math.sin(0.1), 1.0 + 0.75 * math.cos(0.1)]])
    np.testing.assert_allclose(
        rotations(np.array([0.3]), np.array([0.2]))[0].T @ rotations(np.array([0.3]), np.array([0.2]))[0],
        np.eye(3),
        atol=1e-15,
    )


@st.composite
def places(draw):
    """Draw sensors, tilted ones too, and road users among walls, some so near that they are on all sides."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    walls = []
    for _ in range(draw(st.integers(0, 6))):
        x, y, wide, deep, high = random.uniform((-40, -40, 0.5, 0.5, 1), (40, 40, 12, 12, 15))
        walls.append(box_triangles((x, y, 0.0), (x + wide, y + deep, high)))
    poses = random.uniform(
        (-35, -35, -0.3, -math.pi, -0.15), (35, 35, 0.3, math.pi, 0.15), (draw(st.integers(0, 12)), 5)
    )
    sensors = []
    for number in range(draw(st.integers(1, 2))):
        tilt = random.uniform(-0.4, 0.4, 2) * draw(st.booleans())
        turned = rotations(np.array([random.uniform(-3, 3)]), tilt[:1])[0]
        roll = np.array(
            [[1, 0, 0], [0, math.cos(tilt[1]), -math.sin(tilt[1])], [0, math.sin(tilt[1]), math.cos(tilt[1])]]
        )
        model = make_model(azimuth_offsets=random.uniform(-0.1, 0.1, 7), max_range=float(random.uniform(15, 90)))
        xyz = random.uniform((-20, -20, 1.8), (20, 20, 8))
        sensors.append(MountedSensor(f"S{number}", model, xyz, turned @ roll))
    return make_static(ground(), *walls), sensors, parked(*poses)


@each_engine
@cases(25)
@given(place=places())
def test_merged_returns_are_those_of_a_full_scan(engine, place) -> None:
    static, sensors, cars = place
    made = simulation(static, sensors, cars, replace(EXACT, engine=engine))
    bodies = [box_body(user) for user in cars.users]
    snapshot = cars.at(1.0)
    surface, owner = combined(static, bodies, snapshot, engine)
    for scanner, scan in zip(made.scanners, made.scans(snapshot), strict=True):
        full = full_scan(scanner, surface, owner, len(cars))
        rays = differing(scan, full)
        same_place = np.isfinite(full.distance)
        same_place[rays] = False
        np.testing.assert_allclose(scan.distance[same_place], full.distance[same_place], atol=SLACK, rtol=0)
        np.testing.assert_allclose(scan.intensity[same_place], full.intensity[same_place], atol=1e-5)
        for ray in rays:
            assert grazes(scanner.sensor.xyz, scanner.directions[ray], surface.caster.triangles, scan.distance[ray])


@cases(30)
@given(seed=st.integers(0, 2**32 - 1))
def test_windows_hold_every_ray_through_a_hull(seed) -> None:
    random = np.random.default_rng(seed)
    view = random.choice([math.tau, random.uniform(0.05, math.tau), math.radians(359)])
    model = make_model(azimuth_offsets=random.uniform(-0.3, 0.3, 7), field_of_view=view)
    boxes = []
    for _ in range(4):
        size, middle = (
            random.uniform(0.2, 8, 3),
            random.uniform((-20, -20, -6), (20, 20, 6)) * random.choice([0.1, 1.0]),
        )
        boxes.append(
            box_triangles(tuple(middle - size / 2), tuple(middle + size / 2))
            @ rotations(np.array([random.uniform(-3, 3)]), np.zeros(1))[0]
        )
    hulls = np.stack([box.reshape(-1, 3) for box in boxes])
    hull, ray = rays_towards(model, hulls)
    sensor = MountedSensor("S", model, np.zeros(3), np.eye(3))
    directions = simulation(make_static(), [sensor], parked()).scanners[0].directions
    for number, box in enumerate(boxes):
        hit = np.isfinite(first_hits(np.zeros(3), directions, box))
        own = ray[hull == number]
        assert len(np.unique(own)) == len(own)
        assert set(np.flatnonzero(hit)) <= set(own)


def test_a_seed_gives_the_same_frames_in_any_order() -> None:
    static, cars = make_static(ground()), parked((10.0, 2.0, 0.0, 0.3, 0.0), (-8.0, 5.0, 0.0, 1.0, 0.0))
    sensors = [make_sensor(), make_sensor((15.0, 15.0, 5.0), label="S2")]
    forwards = simulation(static, sensors, cars, NOISY)
    backwards = simulation(static, sensors, cars, NOISY)
    frames = [forwards.frame(n, n / 10) for n in range(3)]
    again = [backwards.frame(n, n / 10) for n in (2, 0, 1)]
    assert all(same(one, other) for one, other in zip(frames, (again[1], again[2], again[0]), strict=True))
    assert not np.array_equal(frames[0].points, frames[1].points)
    other = simulation(static, sensors, cars, replace(NOISY, seed=6)).frame(0, 0.0)
    assert not np.array_equal(frames[0].points, other.points)


def test_without_noise_foreground_is_what_traffic_returns() -> None:
    cars = parked((10.0, 0.0, 0.0, 0.0, 0.0), (-7.0, 12.0, 0.0, 1.0, 0.0))
    frame = simulation(make_static(ground()), [make_sensor(), make_sensor((8.0, 9.0, 5.0))], cars).frame(0, 0.0)
    on_cars = frame.instance != STATIC_INSTANCE
    assert on_cars.sum() > 50
    assert not frame.foreground[~on_cars].any()
    lowest = frame.points[on_cars & ~frame.foreground, 2]  # where a tyre stands, the road is no farther
    assert len(lowest) < 0.05 * on_cars.sum()
    assert (lowest < 0.2).all()


def test_noise_hardly_makes_foreground_of_the_background() -> None:
    sensor = make_sensor(range_noise_std=0.1, law=CarlaDropoff(general=0.1))
    frame = simulation(make_static(ground()), [sensor], parked(), NOISY).frame(0, 0.0)
    assert len(frame) > 1000
    assert frame.foreground.mean() < 0.003  # Φ(−3) is 0.0013


def test_noise_is_that_of_the_model() -> None:
    static, sensor = (
        make_static(ground()),
        make_sensor(range_noise_std=0.05, law=CarlaDropoff(general=0.5, zero_intensity=0.0)),
    )
    exact = simulation(static, [sensor], parked()).frame(0, 0.0)
    noisy = simulation(static, [sensor], parked(), NOISY).frame(0, 0.0)
    assert len(noisy) / len(exact) == pytest.approx(0.5, abs=0.03)
    assert not exact.delay.any()
    rise = (exact.points[:, 2] - 4.0) / np.linalg.norm(exact.points - sensor.xyz, axis=1)
    assert noisy.points[:, 2].std() == pytest.approx(0.05 * math.sqrt((rise**2).mean()), rel=0.1)


WAYS = {
    "straight": [(0.0, -7.0, 6.0, 0.0, 0.0, 0.0), (1.0, 23.0, 6.0, 0.0, 0.0, 0.0)],
    "a turn": [(0.0, 6.0, -6.0, 0.0, 0.0, 0.0), (0.05, 7.0, -5.0, 0.0, 0.9, 0.05), (0.3, 6.0, 6.0, 0.3, 2.4, -0.05)],
    "round the sensor": [(0.0, 5.0, 0.0, 0.0, 1.6, 0.0), (0.1, -5.0, 0.5, 0.0, 4.6, 0.0)],
}


@each_engine
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("figures", [{}, {"clockwise": True}, {"field_of_view": math.radians(300)}])
def test_with_a_rolling_shutter_each_ray_meets_what_is_there_at_its_own_time(engine, way, figures) -> None:
    yaw = 2.6 if way == "round the sensor" and figures.keys() == {"field_of_view"} else 0.0  # begin where the car does
    cars, sensor = make_trajectories(WAYS[way]), make_sensor(yaw=yaw, **figures)
    made = simulation(make_static(), [sensor], cars, ScanSettings(noise=False, rolling_shutter=True, engine=engine))
    (scan,) = made.scans(cars.at(0.0))
    (scanner,) = made.scanners
    body = box_body(cars.users[0]).triangles
    expected = np.full(len(scan.distance), np.inf)
    for step in range(0, 720, 3):
        turn = (720 - step) % 720 if sensor.model.clockwise else step
        then = cars.at(min(turn / 7200, WAYS[way][-1][0]))
        turned = rotations(then.yaw, then.pitch)[0]
        rays = np.arange(7) * 720 + step
        expected[rays] = first_hits(sensor.xyz, scanner.directions[rays], then.position + body @ turned.T)
    looked = np.flatnonzero(np.arange(len(expected)) % 720 % 3 == 0)
    assert np.isfinite(expected[looked]).sum() > 10
    different = np.isfinite(expected[looked]) != np.isfinite(scan.distance[looked])
    assert different.sum() <= 1
    both = looked[np.isfinite(expected[looked]) & np.isfinite(scan.distance[looked])]
    np.testing.assert_allclose(scan.distance[both], expected[both], atol=1e-4)


def test_a_rolling_shutter_moves_a_face_by_speed_times_delay() -> None:
    """A car of 30 m/s drives away along +y; a sensor that starts along +x meets its back a quarter turn later."""
    car = make_trajectories([(0.0, 0.0, 20.0, 0.0, math.pi / 2, 0.0), (1.0, 0.0, 50.0, 0.0, math.pi / 2, 0.0)])
    sensor = make_sensor((0.0, 0.0, 0.75), elevations=np.zeros(1), points_per_second=36000.0)
    rolling = simulation(make_static(), [sensor], car, replace(EXACT, rolling_shutter=True)).frame(0, 0.0)
    still = simulation(make_static(), [sensor], car).frame(0, 0.0)
    assert not still.delay.any()
    np.testing.assert_allclose(still.points[:, 1], 18.0, atol=1e-5)
    np.testing.assert_allclose(rolling.points[:, 1], 18.0 + 30.0 * rolling.delay, atol=2e-5)
    np.testing.assert_allclose(rolling.delay, 0.025, atol=0.001)
    assert still.labels.centre[0, 1] == 20.0
    assert rolling.labels.centre[0, 1] == pytest.approx(20.0 + 30.0 * rolling.delay.mean(), abs=1e-5)  # box and points


def outside(frame, margin):
    """Return which returns of the one road user lie outside its box by more than a margin."""
    labels = frame.labels
    turned = rotations(labels.yaw, labels.pitch)[0]
    own = np.abs((frame.points[frame.instance == 0] - labels.centre[0]) @ turned)
    return (own > labels.size[0] / 2 + margin).any(axis=1)


@pytest.mark.parametrize("key", ["type1", "vlp32c"])
def test_a_truck_at_14_metres_a_second_stays_in_its_box(key) -> None:
    """At 5 Hz it drives 2.8 m in a revolution; of all that returns from it 99 % lie in its box, but for the noise."""
    model = load_catalogue()[key]
    truck = RoadUser("truck", "truck", 9.6, 2.55, 3.75)
    way = [(0.0, -60.0, 12.0, 0.0, 0.0, 0.0), (10.0, 80.0, 12.0, 0.0, 0.0, 0.0)]
    trajectories = make_trajectories(way, users=[truck])
    made = simulation(
        make_static(ground()), [MountedSensor("S1", model, np.array([0.0, 0.0, 5.4]), np.eye(3))], trajectories,
        ScanSettings(rolling_shutter=True),
    )  # fmt: skip
    seen = [
        outside(made.frame(number, time), 3 * model.range_noise_std) for number, time in enumerate(np.arange(1, 9, 0.7))
    ]
    assert sum(map(len, seen)) > 1000
    assert np.concatenate(seen).mean() < 0.01


def test_the_box_of_one_that_nobody_sees_is_that_of_mid_revolution() -> None:
    way = [(0.0, 500.0, 0.0, 0.0, 0.0, 0.0), (1.0, 510.0, 0.0, 0.0, 0.4, 0.0)]
    made = simulation(
        make_static(ground()), [make_sensor()], make_trajectories(way), replace(EXACT, rolling_shutter=True)
    )
    frame = made.frame(0, 0.3)
    assert not frame.labels.points.any()
    halfway = make_trajectories(way).at(0.3 + 0.05)
    np.testing.assert_allclose(frame.labels.centre[0, :2], halfway.position[0, :2], atol=1e-9)
    np.testing.assert_allclose(frame.labels.yaw, halfway.yaw, atol=1e-9)


def test_a_sensor_that_sees_nothing_gives_an_empty_cloud_and_a_warning(tmp_path) -> None:
    made = simulation(make_static(), [make_sensor()], parked((300.0, 0.0, 0.0, 0.0, 0.0)))
    assert "S1 sees nothing" in made.warnings[0]
    frame = made.frame(0, 0.0)
    frame.save(tmp_path / "frame.npz")
    assert len(Frame.load(tmp_path / "frame.npz")) == 0
    assert not simulation(make_static(ground()), [make_sensor()], parked()).warnings


def test_a_static_scene_does_not_depend_on_the_order_of_objects() -> None:
    shiny = Mesh("a", box_triangles((0, 0, 0), (1, 1, 1)), np.full(12, 0.9))
    plain = Mesh("b", box_triangles((3, 0, 0), (4, 1, 1)))
    scenes = []
    for occluders in ((shiny, plain), (plain, shiny)):
        geometry = SceneGeometry("x", np.zeros(3), (Mesh("road", ground()),), (), occluders, make_static().region)
        scenes.append(static_scene(geometry))
    np.testing.assert_array_equal(scenes[0].triangles, scenes[1].triangles)
    np.testing.assert_array_equal(scenes[0].reflectivity, scenes[1].reflectivity)
    assert sorted(scenes[0].reflectivity.tolist()) == [0.3] * 14 + [0.9] * 12
    assert (scenes[0].reflectivity == 0.9).sum() == 12
    assert level_orientation(math.pi / 2) @ [1, 0, 0] == pytest.approx([0, 1, 0])


ROOT = Path(__file__).resolve().parents[4]
THREADS = """
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier
import numpy as np
import shapely
from seip_addon.core.sensing.scans.static_scene import StaticScene
random = np.random.default_rng(2)
nothing = np.empty((0, 3, 3)), np.empty(0)
points = random.uniform(-0.5, 0.5, (50, 3))
begin = Barrier(4)
def ask(scene):
    begin.wait()
    return scene.inside(points)
with ThreadPoolExecutor(4) as pool:
    for _ in range(8_000):
        angles = np.sort(random.uniform(0.0, 2 * np.pi, 300))
        region = shapely.Polygon(np.column_stack([np.cos(angles), np.sin(angles)]))
        assert all(found.all() for found in pool.map(ask, [StaticScene(*nothing, region)] * 4))
"""


@pytest.mark.slow
def test_points_are_looked_for_in_a_region_from_threads():
    """Without the region's index, some runs of this end with a corrupt heap."""
    subprocess.run([sys.executable, "-c", THREADS], cwd=ROOT, check=True)  # noqa: S603
