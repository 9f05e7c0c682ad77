"""Quaternions and rotations of files."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from seip_addon.core.geometry.orientation import nearest_rotation, quaternion_of, quaternion_rotation

ANGLE = st.floats(-np.pi, np.pi) | st.sampled_from([0.0, np.pi / 2, -np.pi / 2, np.pi])


@given(ANGLE, ANGLE, ANGLE)
def test_quaternions_against_scipy(yaw, tilt, roll):
    turn = Rotation.from_euler("ZYX", [yaw, tilt, roll])
    x, y, z, w = turn.as_quat()
    np.testing.assert_allclose(quaternion_rotation(np.array([w, x, y, z])), turn.as_matrix(), rtol=0.0, atol=1e-12)
    quaternion = quaternion_of(turn.as_matrix())
    assert np.linalg.norm(quaternion) == pytest.approx(1.0, abs=1e-12)
    assert abs(quaternion @ [w, x, y, z]) == pytest.approx(1.0, abs=1e-9)


@given(ANGLE, ANGLE, ANGLE, st.integers(0, 100))
def test_the_nearest_rotation(yaw, tilt, roll, seed):
    turn = Rotation.from_euler("ZYX", [yaw, tilt, roll]).as_matrix()
    rough = turn + np.random.default_rng(seed).uniform(-2e-4, 2e-4, (3, 3))
    nearest = nearest_rotation(rough)
    np.testing.assert_allclose(nearest, Rotation.from_matrix(rough).as_matrix(), rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(nearest.T @ nearest, np.eye(3), rtol=0.0, atol=1e-14)
    with pytest.raises(ValueError, match="mirrored"):
        nearest_rotation(-turn)
    with pytest.raises(ValueError, match="scaled or skewed"):
        nearest_rotation(1.01 * turn)
