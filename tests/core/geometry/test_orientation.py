"""Quaternions and rotations of files."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from seip_addon.core.geometry.orientation import quaternion_of, quaternion_rotation

ANGLE = st.floats(-np.pi, np.pi) | st.sampled_from([0.0, np.pi / 2, -np.pi / 2, np.pi])


@given(ANGLE, ANGLE, ANGLE)
def test_quaternions_against_scipy(yaw, tilt, roll):
    turn = Rotation.from_euler("ZYX", [yaw, tilt, roll])
    x, y, z, w = turn.as_quat()
    np.testing.assert_allclose(quaternion_rotation(np.array([w, x, y, z])), turn.as_matrix(), rtol=0.0, atol=1e-12)
    quaternion = quaternion_of(turn.as_matrix())
    assert np.linalg.norm(quaternion) == pytest.approx(1.0, abs=1e-12)
    assert abs(quaternion @ [w, x, y, z]) == pytest.approx(1.0, abs=1e-9)
