"""Draws of pose errors."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from seip_addon.core.errors import SeipError
from seip_addon.core.sensing.scans.sensor import level_orientation
from seip_addon.core.sensing.scenarios.pose_errors import PoseDraws, PoseErrors, draw_errors, out_of_objects
from seip_addon.core.site.obstruction import inside_any
from seip_addon.core.site.scene_geometry import Mesh
from tests.builders.synthetic_junction import prism

FEET = np.array([[0.0, 0, 0], [5, -3, 0.12], [-5, 3, 0.12], [5, -3, 0.12]])


def test_a_position_errs_alike_whatever_hangs_there_and_whoever_else_is_asked():
    together, alone = draw_errors(PoseErrors(), FEET, 20, 7), draw_errors(PoseErrors(), FEET[1:2], 50, 7)
    for name in ("shift", "yaw", "pitch", "roll"):
        drawn = getattr(together, name)
        assert (drawn[:, 1] == drawn[:, 3]).all()
        assert (drawn[:, 1] == getattr(alone, name)[:20, 0]).all()
        assert (drawn[:, 1] != drawn[:, 2]).all()
    assert (draw_errors(PoseErrors(), FEET, 20, 8).shift != together.shift).all()


def test_they_are_as_wide_as_they_are_said_to_be():
    errors = PoseErrors(position=0.5, height=0.1, yaw=0.2, tilt=0.03)
    drawn = draw_errors(errors, np.column_stack([np.arange(50.0), np.zeros((50, 2))]), 2000, 1)
    for values, scale in [
        (drawn.shift[..., 0], 0.5),
        (drawn.shift[..., 1], 0.5),
        (drawn.shift[..., 2], 0.1),
        (drawn.yaw, 0.2),
        (drawn.pitch, 0.03),
        (drawn.roll, 0.03),
    ]:
        assert stats.kstest(values.ravel() / scale, "norm").pvalue > 1e-3
    assert abs(np.corrcoef(drawn.shift[:, 0, 0], drawn.shift[:, 1, 0])[0, 1]) < 0.1


def turned(yaw, pitch, roll):
    nod = np.array([[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]])
    lean = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
    return level_orientation(yaw) @ nod @ lean


@given(*(st.floats(-3, 3) for _ in range(5)))
def test_orientations_are_yaw_then_pitch_then_roll(planned, tilt, yaw, pitch, roll):
    draws = PoseDraws(np.zeros((1, 1, 3)), *(np.array([[angle]]) for angle in (yaw, pitch, roll)))
    drawn = draws.orientations(np.array([planned]), np.array([tilt]))[0, 0]
    assert drawn == pytest.approx(turned(planned + yaw, tilt + pitch, roll), abs=1e-12)


def test_a_sensor_leaves_the_object_that_it_would_be_in():
    post = Mesh("post", np.concatenate([prism((1.0, 0.0), 0.5, 9.0), prism((-1.0, 0.0), 0.5, 9.0)]))
    floor = Mesh("one post", prism((1.0, 0.0), 0.5, 9.0))
    shift = np.array([[[1.0, 0.0, 0.0]], [[0.2, 0.0, 0.0]]])
    draws = PoseDraws(shift, *(np.zeros((2, 1)) for _ in range(3)))
    where = np.array([[0.0, 0.0, 4.0]])
    turned_about = out_of_objects(draws, where, [floor])
    assert inside_any((where + shift).reshape(-1, 3), [floor]).tolist() == [True, False]
    assert turned_about.shift[:, 0, 0].tolist() == [-1.0, 0.2]
    assert out_of_objects(draws, where, [post]).shift[:, 0, 0].tolist() == [0.0, 0.2]


@pytest.mark.parametrize("wrong", [{"position": -1.0}, {"yaw": math.nan}])
def test_errors_that_cannot_be_meant_are_refused(wrong):
    with pytest.raises(SeipError, match="error of"):
        PoseErrors(**wrong)
