"""The curves of the reference line against independent integration, and profiles against their definition."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.integrate import quad, solve_ivp

from seip_addon.core.world.opendrive.profile import profile
from seip_addon.core.world.opendrive.reference_line import Clothoid, ReferenceLine, param_poly3, poly3
from tests.oracles.random_cases import cases

curvatures = st.floats(-0.2, 0.2)
lengths = st.floats(1e-6, 300.0)


def at(piece, distance):
    return np.array([values[0] for values in piece(np.array([distance]))])


@pytest.mark.parametrize("curvature", [0.02, -0.3, 1e-9])
def test_an_arc_is_a_piece_of_its_circle(curvature):
    x, y, heading = at(Clothoid(curvature, 0.0), 40.0)
    np.testing.assert_allclose([x, heading], [math.sin(40 * curvature) / curvature, 40 * curvature], atol=1e-12)
    assert math.hypot(x, y - 1 / curvature) == pytest.approx(1 / abs(curvature), abs=1e-9)


@given(curvatures, curvatures, lengths)
@cases(25)
def test_a_clothoid_is_the_integral_of_its_heading(first, last, length):
    rate = (last - first) / length

    def heading(s):
        return s * (first + s * rate / 2)

    expected = [
        quad(lambda s, of=of: of(heading(s)), 0, length, epsabs=1e-11, epsrel=0, limit=500)[0]
        for of in (math.cos, math.sin)
    ]
    np.testing.assert_allclose(at(Clothoid(first, rate), length)[:2], expected, atol=1e-9)


def by_stepping(u, v, stretch, length):
    """Walk along (u(p), v(p)) at ``stretch`` metres of arc per metre, and return where the walk ends."""
    u, v = Polynomial(u), Polynomial(v)
    du, dv = u.deriv(), v.deriv()
    walk = solve_ivp(
        lambda _, p: stretch / np.hypot(du(p), dv(p)), (0.0, length), [0.0], method="DOP853", rtol=1e-12, atol=1e-12
    )
    p = walk.y[0, -1]
    return [u(p), v(p), math.atan2(dv(p), du(p))]


cubics = st.tuples(st.floats(-2, 2), st.floats(-0.5, 0.5), st.floats(-2e-2, 2e-2), st.floats(-2e-4, 2e-4))


@given(cubics, st.floats(1.0, 100.0), st.floats(0.0, 1.0))
@cases(25)
def test_poly3_is_walked_by_its_arc(coefficients, length, share):
    expected = by_stepping([0, 1, 0, 0], coefficients, 1.0, share * length)
    np.testing.assert_allclose(at(poly3(coefficients, length), share * length), expected, atol=1e-8)


@given(
    st.tuples(st.just(0.0), st.floats(20, 60), st.floats(-8, 8), st.floats(-4, 4)),
    st.tuples(st.just(0.0), st.floats(-8, 8), st.floats(-20, 20), st.floats(-10, 10)),
    st.floats(0.0, 1.0),
    st.floats(0.9, 1.1),
)
@cases(25)
def test_a_normalised_parametric_cubic_is_walked_by_its_arc(u, v, share, misstated):
    du, dv = Polynomial(u).deriv(), Polynomial(v).deriv()
    arc = quad(lambda p: math.hypot(du(p), dv(p)), 0, 1, epsabs=1e-12, limit=200)[0]
    length = arc * misstated
    curve = param_poly3(u, v, 1.0, length)
    np.testing.assert_allclose(at(curve, share * length), by_stepping(u, v, arc / length, share * length), atol=1e-8)
    end = [sum(u), sum(v), math.atan2(dv(1), du(1))]
    np.testing.assert_allclose(at(curve, length), end, atol=1e-9)


def test_pieces_follow_their_own_starts_far_from_the_origin():
    line = ReferenceLine(
        s=np.array([0.0, 10.0]),
        length=np.array([10.0, math.pi]),
        start=np.array([[5.4e6, 3.5e5, math.pi / 2], [5.4e6, 3.5e5 + 10.0, math.pi / 2]]),
        pieces=(Clothoid(0.0, 0.0), Clothoid(1.0, 0.0)),
    )
    x, y, heading = line(np.array([0.0, 4.0, 10.0, 10.0 + math.pi]))
    np.testing.assert_allclose(x - 5.4e6, [0, 0, 0, -2], atol=2e-9)
    np.testing.assert_allclose(y - 3.5e5, [0, 4, 10, 10], atol=2e-9)
    np.testing.assert_allclose(heading, [math.pi / 2] * 3 + [1.5 * math.pi], atol=1e-12)


def test_each_record_of_a_profile_counts_from_its_own_start():
    records = profile([(10.0, (5.0, 1.0, 0.0, 0.0)), (2.0, (1.0, 0.0, 0.5, 0.0)), (10.0, (7.0, 2.0, 0.0, 0.25))])
    s = np.array([0.0, 2.0, 4.0, 10.0, 12.0])
    np.testing.assert_allclose(records(s), [1.0, 1.0, 3.0, 7.0, 13.0])
    np.testing.assert_allclose(records.slope(s), [0.0, 0.0, 2.0, 2.0, 5.0])
