"""A tilted candidate sees what a sensor sees that hangs so, and an upright one what it saw without the tilted ones."""

import math
from dataclasses import replace

from headless.studies.stability.criterion import Evaluator

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.choosing.placement.deployment import deploy
from seip_addon.core.choosing.placement.objective import Objective
from seip_addon.core.geometry.orientation import orientation, orientations
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.lidar.range_equation import RangeEquation
from seip_addon.core.sensing.scans.sensor import level_orientation
from seip_addon.core.sensing.scenarios.pose_errors import PoseErrors
from seip_addon.core.sensing.scenarios.scenario_visibility import visibility_under_errors
from seip_addon.core.sensing.visibility.grid import (
    FILE,
    VisibilitySettings,
    compute_visibility,
    visibility_key,
)
from seip_addon.core.sensing.visibility.ray_casting import make_ray_caster
from seip_addon.core.sensing.visibility.ring_resolution import resolution_warnings
from seip_addon.core.sensing.visibility.surroundings import Surroundings
from seip_addon.core.sensing.visibility.visibility_model import visibility_model
from seip_addon.core.site.candidates import CandidateSettings, generate_candidates
from seip_addon.core.site.scene_geometry import Mesh, Pole, SceneGeometry
from seip_addon.core.site.site import Site, Targets
from seip_addon.core.storage.files import digest
from seip_addon.core.storage.source_digest import source_digest
from seip_addon.core.workflows.survey_settings import SurveySettings
from tests.builders.synthetic_junction import junction_site, make_candidates, prism, rectangle, varied_reflectivity
from tests.engines import ANY, each_engine
from tests.oracles.float64_rays import nearest_return
from tests.oracles.full_scan import full_scan
from tests.oracles.random_cases import cases

MODELS = {key: replace(model, points_per_second=model.points_per_second / 8) for key, model in load_catalogue().items()}
PHYSICAL = {key: replace(model, law=RangeEquation.of_ranges(12.0, 30.0)) for key, model in MODELS.items()}
VIEWS = {"type1": math.radians(120), "type2": math.radians(350)}
ONE_WAY = {key: replace(MODELS[key], field_of_view=view) for key, view in VIEWS.items()}
STRENGTHS = st.sampled_from([(MODELS, 0.0), (MODELS, 0.2), (PHYSICAL, 0.0), (ONE_WAY, 0.0), (ONE_WAY, 0.2)])
SIGHT = VisibilitySettings()
NOISE = 2e-3
"""Metres from δ within which float32 and float64 may disagree."""
TILT = st.floats(-1.4, 1.4)


def patch(seed, poses=3):
    """A sloping patch of road with boxes on it; sensors of all types above it, two at each place, tilted anyhow."""
    random = np.random.default_rng(seed)
    slope = random.normal(0, 0.03, 2)
    road = rectangle((-15, -15), (15, 15), step=10.0)
    road[:, :, 2] = road[:, :, :2] @ slope
    boxes = [
        prism(tuple(random.uniform(-12, 12, 2)), random.uniform(0.2, 3), random.uniform(1, 6), sides=4)
        for _ in range(random.integers(0, 5))
    ]
    target = random.uniform(-14, 14, (60, 3))
    target[:, 2] = target[:, :2] @ slope
    xyz = np.repeat(random.uniform((-14, -14, 2.5), (14, 14, 8), (poses, 3)), 2, axis=0)
    yaw = np.repeat(random.uniform(-math.pi, math.pi, poses), 2)
    tilt = np.repeat(random.uniform(-0.6, 0.6, poses), 2)
    sensor = ["type1", "type2"] * poses
    triangles = np.concatenate([road, *boxes])
    return Site(
        name="patch",
        origin=np.zeros(3),
        region=shapely.box(-15, -15, 15, 15),
        targets=Targets(target, np.ones(60), np.zeros(60, dtype=bool), 1.0),
        candidates=make_candidates(xyz, sensor, xyz[:, 2], yaw, tilt),
        triangles=triangles,
        reflectivity=varied_reflectivity(triangles),
    )


def grid_of(site, settings=SIGHT, engine=ANY):
    return finish(compute_visibility(site, MODELS, settings, engine))


def tilted(site, yaw, tilt):
    """The same poses, all turned so."""
    every = np.ones(len(site.candidates))
    return replace(site, candidates=replace(site.candidates, yaw=yaw * every, tilt=tilt * every))


@each_engine
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.3, 1.0, 3.0]),
    STRENGTHS,
)
@cases(20, 4)
def test_same_as_the_full_scan_bit_for_bit(engine, seed, delta, strength):
    site, (models, min_intensity) = patch(seed), strength
    settings = VisibilitySettings(delta, min_intensity)
    full, _ = full_scan(site, models, settings, make_ray_caster(site.triangles, engine))
    assert (finish(compute_visibility(site, models, settings, engine)).visible == full).all()


@given(st.integers(0, 2**32 - 1), st.floats(-4, 4), TILT, st.sampled_from([MODELS, ONE_WAY]))
@cases(15, 4)
def test_a_tilted_candidate_sees_what_an_onlooker_sees_and_what_rays_in_float64_return_from(seed, yaw, tilt, models):
    site = tilted(patch(seed, poses=1), yaw, tilt)
    visible, poses = finish(compute_visibility(site, models, SIGHT, ANY)).visible, site.candidates
    looks = visibility_model(site, SIGHT, ANY)
    for pose, key in enumerate(poses.sensor.tolist()):
        turn = level_orientation(yaw) @ nose_down(tilt)
        assert (looks.see(models[key], poses.xyz[pose], poses.orientation(pose)) == visible[pose]).all()
        triangles, targets = ((points - poses.xyz[pose]) @ turn for points in (site.triangles, site.targets.xyz))
        nearest = nearest_return(np.zeros(3), 0.0, models[key], triangles, targets)
        clear = np.abs(nearest - SIGHT.delta) > NOISE
        assert (visible[pose] == (nearest < SIGHT.delta))[clear].all()


def nose_down(tilt):
    cos, sin = math.cos(tilt), math.sin(tilt)
    return np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])


@given(st.floats(-4, 4), TILT, st.floats(-1, 1))
def test_orientations_turn_then_nod_then_roll(yaw, tilt, roll):
    rolled = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
    expected = level_orientation(yaw) @ nose_down(tilt) @ rolled
    assert orientations(np.array([yaw]), np.array([tilt]), np.array([roll]))[0] == pytest.approx(expected, abs=1e-12)
    ahead = orientation(yaw, tilt)[:, 0]
    assert math.atan2(-ahead[2], math.hypot(*ahead[:2])) == pytest.approx(tilt, abs=1e-9)
    assert math.cos(tilt) * np.array([math.cos(yaw), math.sin(yaw)]) == pytest.approx(ahead[:2], abs=1e-9)


def test_the_key_of_an_upright_grid_is_as_it_was_before_there_were_tilts():
    site = street_site(generate_candidates(street(), CHOICE))
    poses, model = site.candidates, MODELS["type1"]
    pattern = [model.elevations, model.azimuth_offsets, float(model.azimuth_count)]
    pattern += [float(model.min_range), float(model.max_range)]
    known = digest(
        *(
            FILE.schema,
            source_digest(),
            ANY,
            1.0,
            "(0.0, '')",
            site.triangles,
            site.targets.xyz,
            poses.xyz,
            poses.yaw,
        ),
        *(np.zeros(len(poses), dtype=np.int64), *pattern),
    )
    assert visibility_key(site, MODELS, SIGHT, ANY) == known
    keys = {visibility_key(tilted(site, 0.0, tilt), MODELS, SIGHT, ANY) for tilt in (0.0, 0.1, 0.2)}
    assert len(keys) == 3
    views = {visibility_key(site, {"type1": replace(model, field_of_view=view)}, SIGHT, ANY) for view in (1.0, 2.0)}
    assert len({known, *views}) == 3
    assert visibility_key(site, {"type1": replace(model, clockwise=True)}, SIGHT, ANY) == known


CHOICE = CandidateSettings(sensors=("type1",), heights=(3.5, 8.0), spacing=12.0)


def street(**changes):
    """A road along x with a pavement on its north side."""
    geometry = SceneGeometry(
        name="street",
        origin=np.zeros(3),
        roads=(Mesh("road", rectangle((-30, -7), (30, 7))),),
        ground=(Mesh("pavement", rectangle((-30, 7), (30, 10), z=0.1)),),
        occluders=(Mesh("house", prism((5.0, 16.0), 4.0, 9.0, sides=4)),),
        region=shapely.box(-30, -7, 30, 7),
        candidate_areas=shapely.box(-30, 7, 30, 10),
    )
    return replace(geometry, **changes)


def street_site(candidates):
    x, y = (values.ravel() for values in np.meshgrid(np.arange(-29.0, 30, 2), np.arange(-6.0, 7, 2)))
    targets = Targets(np.column_stack([x, y, 0 * x]), np.ones(len(x)), np.zeros(len(x), dtype=bool), 2.0)
    parts = [mesh.triangles for mesh in (*street().roads, *street().ground, *street().occluders)]
    triangles = np.concatenate(parts)
    reflectivity = np.full(len(triangles), 0.3)
    return Site("street", np.zeros(3), street().region, targets, candidates, triangles, reflectivity)


def test_poses_are_positions_by_heights_by_tilts_by_types_and_tilted_ones_face_the_region():
    pole = Pole("signal", np.array((35.0, 9.0, 0.1)))
    tilts = (math.radians(10), 0.0, math.radians(-5))
    candidates = generate_candidates(street(poles=(pole,)), replace(CHOICE, sensors=("type1", "type3"), tilts=tilts))
    assert len(candidates) == len(candidates.position) * 2 * 3 * 2
    assert candidates.sensor[:6].tolist() == ["type1", "type3"] * 3
    assert np.degrees(candidates.tilt[:6]) == pytest.approx([-5, -5, 0, 0, 10, 10])
    assert candidates.height[:12].tolist() == [3.5] * 6 + [8.0] * 6
    at_pole = candidates.on_pole[candidates.position_of]
    upright = candidates.tilt == 0
    assert not candidates.yaw[upright].any()
    assert candidates.yaw[at_pole & ~upright] == pytest.approx(math.atan2(7 - 9, 30 - 35), abs=1e-6)
    assert candidates.yaw[~at_pole & ~upright] == pytest.approx(-math.pi / 2, abs=1e-6)


@pytest.mark.parametrize(
    ("tilts", "sentence"),
    [
        ((), "no tilt is given"),
        ((math.nan,), "a tilt must be more than -90° and less than 90°, not nan°"),
        ((0.0, math.radians(90)), "less than 90°, not 90°"),
        ((math.radians(-90),), "more than -90° .* not -90°"),
        ((math.inf,), "not inf°"),
        ((0.1, 0.0, 0.1), "the tilt of 5.72958° is given twice"),
        ((0.0, -0.0), "the tilt of -0° is given twice"),
    ],
)
def test_each_wrong_tilt_has_its_sentence(tilts, sentence):
    with pytest.raises(SeipError, match=sentence):
        CandidateSettings(tilts=tilts)


def test_visibility_without_errors_is_the_grid_whatever_hangs_at_one_place():
    site = patch(5, poses=2)
    poses = site.candidates
    together = replace(poses, xyz=np.repeat(poses.xyz[:1], 4, axis=0), yaw=np.full(4, 0.3), tilt=poses.tilt)
    together = replace(together, tilt=np.array([0.0, 0.0, 0.4, 0.4]))
    site = replace(site, candidates=together)
    around, nothing = Surroundings(site, MODELS, SIGHT, (), ANY), PoseErrors(0.0, 0.0, 0.0, 0.0)
    views = finish(visibility_under_errors(around, np.arange(4), nothing, draws=1, seed=0))
    assert (views.seen(0) == grid_of(site).visible).all()
    assert (views.seen(0)[0] != views.seen(0)[2]).any()


def test_a_chosen_sensor_is_turned_as_its_candidate_and_evaluated_so():
    geometry = street()
    candidates = generate_candidates(geometry, replace(CHOICE, tilts=(math.radians(20),)))
    site = street_site(candidates)
    visible = grid_of(site).visible
    deployment = deploy(site, MODELS, visible[[0, 5]], [0, 5])
    for sensor in deployment.sensors:
        assert sensor.tilt == pytest.approx(math.radians(20))
        assert (sensor.orientation == candidates.orientation(sensor.pose)).all()
        looks = visibility_model(site, SIGHT, ANY)
        assert (looks.see(sensor.model, sensor.xyz, sensor.orientation) == visible[sensor.pose]).all()


def test_a_placement_of_tilted_sensors_is_evaluated_as_they_are_mounted():
    settings = SurveySettings(candidates=replace(CHOICE, heights=(5.0,), tilts=(math.radians(20),)), engine=ANY)
    evaluator = Evaluator(street(), settings, Objective(count=1))
    solution = finish(evaluator.solve(street_site(generate_candidates(street(), settings.candidates)), settings))
    (sensor,) = solution.deployment.sensors
    looks = visibility_model(evaluator.site, SIGHT, ANY)
    as_it_hangs = looks.see(sensor.model, sensor.xyz, sensor.orientation).mean()
    assert evaluator.evaluate(solution) == pytest.approx(as_it_hangs, abs=1e-12)
    assert as_it_hangs != looks.see(sensor.model, sensor.xyz, level_orientation(sensor.yaw)).mean()


def test_the_warning_of_rings_tells_upright_from_tilted_sensors():
    site, models = junction_site(positions=8, sensors=("type1",), heights=(3.5,)), load_catalogue()
    upright = resolution_warnings(site, models, SIGHT)
    assert len(upright) == 1
    assert "tilted" not in upright[0]
    some = replace(site.candidates, tilt=np.where(np.arange(len(site.candidates)) % 2, 0.2, 0.0))
    both = resolution_warnings(replace(site, candidates=some), models, SIGHT)
    assert len(both) == 1
    assert "in front of it (behind a tilted sensor from a shorter distance)" in both[0]
