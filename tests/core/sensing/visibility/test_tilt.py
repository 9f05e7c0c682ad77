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
from seip_addon.core.sensing.scans.sensor import level_orientation
from seip_addon.core.sensing.visibility.grid import (
    VisibilitySettings,
    compute_visibility,
)
from seip_addon.core.sensing.visibility.ring_resolution import resolution_warnings
from seip_addon.core.sensing.visibility.visibility_model import visibility_model
from seip_addon.core.site.candidates import CandidateSettings, generate_candidates
from seip_addon.core.site.scene_geometry import Mesh, Pole, SceneGeometry
from seip_addon.core.site.site import Site, Targets
from seip_addon.core.workflows.survey_settings import SurveySettings
from tests.builders.synthetic_junction import junction_site, prism, rectangle
from tests.engines import ANY

MODELS = {key: replace(model, points_per_second=model.points_per_second / 8) for key, model in load_catalogue().items()}
SIGHT = VisibilitySettings()
TILT = st.floats(-1.4, 1.4)


def grid_of(site, settings=SIGHT, engine=ANY):
    return finish(compute_visibility(site, MODELS, settings, engine))


def tilted(site, yaw, tilt):
    """The same poses, all turned so."""
    every = np.ones(len(site.candidates))
    return replace(site, candidates=replace(site.candidates, yaw=yaw * every, tilt=tilt * every))


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
