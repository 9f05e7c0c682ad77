"""Draws of pose errors."""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy import stats

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.geometry.orientation import orientation
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.scenarios.pose_errors import PoseErrors, draw_errors, out_of_objects
from seip_addon.core.sensing.scenarios.scenario_visibility import visibility_under_errors
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.surroundings import Surroundings
from seip_addon.core.sensing.visibility.visibility_model import visibility_model
from seip_addon.core.site.obstruction import inside_any
from seip_addon.core.site.scene_geometry import Mesh
from tests.builders.synthetic_junction import junction_site, prism
from tests.engines import ANY, needs_any

FEET = np.array([[0.0, 0, 0], [5, -3, 0.12], [-5, 3, 0.12], [5, -3, 0.12]])


def test_a_position_errs_alike_whatever_hangs_there_and_whoever_else_is_asked():
    together, alone = draw_errors(PoseErrors(), FEET, 20, 7), draw_errors(PoseErrors(), FEET[1:2], 50, 7)
    assert (together[:, 1] == together[:, 3]).all()
    assert (together[:, 1] == alone[:20, 0]).all()
    assert (together[:, 1] != together[:, 2]).all()
    assert (draw_errors(PoseErrors(), FEET, 20, 8) != together).all()


def test_they_are_as_wide_as_they_are_said_to_be():
    errors = PoseErrors(position=0.5, height=0.1, yaw=0.2, tilt=0.03)
    drawn = draw_errors(errors, np.column_stack([np.arange(50.0), np.zeros((50, 2))]), 2000, 1)
    for number, scale in enumerate((0.5, 0.5, 0.1, 0.2, 0.03, 0.03)):
        assert stats.kstest(drawn[..., number].ravel() / scale, "norm").pvalue > 1e-3
    assert abs(np.corrcoef(drawn[:, 0, 0], drawn[:, 1, 0])[0, 1]) < 0.1


@needs_any
def test_sensors_with_errors_see_what_sensors_at_those_poses_see():
    site = junction_site(positions=4, sensors=("type1", "type2"), heights=(5.4,), spacing=4.0)
    site = replace(site, candidates=replace(site.candidates, tilt=np.full(8, 0.1)))
    models, candidates, errors = load_catalogue(), site.candidates, PoseErrors(0.5, 0.1, 0.2, 0.05)
    model = visibility_model(site, VisibilitySettings(), ANY)
    poses = np.array([1, 2, 6])
    drawn = draw_errors(errors, candidates.position[candidates.position_of[poses]], 3, 7)
    around = Surroundings(site, models, VisibilitySettings(), (), ANY)
    views = finish(visibility_under_errors(around, poses, errors, 3, 7))
    for draw, (one, pose) in product(range(3), enumerate(poses)):
        shift, (yaw, pitch, roll) = drawn[draw, one, :3], drawn[draw, one, 3:]
        turned = orientation(candidates.yaw[pose] + yaw, 0.1 + pitch, roll)
        seen = model.see(models[candidates.sensor[pose]], candidates.xyz[pose] + shift, turned)
        assert (views.seen(draw)[one] == seen).all()
        assert seen.any()


def test_a_sensor_leaves_the_object_that_it_would_be_in():
    post = Mesh("post", np.concatenate([prism((1.0, 0.0), 0.5, 9.0), prism((-1.0, 0.0), 0.5, 9.0)]))
    floor = Mesh("one post", prism((1.0, 0.0), 0.5, 9.0))
    shift = np.array([[[1.0, 0.0, 0.0]], [[0.2, 0.0, 0.0]]])
    drawn = np.append(shift, np.full((2, 1, 3), 0.5), axis=2)
    where = np.array([[0.0, 0.0, 4.0]])
    assert inside_any((where + shift).reshape(-1, 3), [floor]).tolist() == [True, False]
    assert out_of_objects(drawn, where, [floor])[:, 0].tolist() == [[-1, 0, 0, *[0.5] * 3], [0.2, 0, 0, *[0.5] * 3]]
    assert out_of_objects(drawn, where, [post])[:, 0, 0].tolist() == [0.0, 0.2]


@pytest.mark.parametrize("wrong", [{"position": -1.0}, {"yaw": math.nan}])
def test_errors_that_cannot_be_meant_are_refused(wrong):
    with pytest.raises(SeipError, match="error of"):
        PoseErrors(**wrong)
