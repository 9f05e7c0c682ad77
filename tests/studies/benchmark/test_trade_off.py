"""The front of ways to an answer, and how costs grow."""

from headless.studies.benchmark.pareto_front import Method, front, growth_exponent

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

WAYS = st.lists(
    st.tuples(st.integers(1, 9), st.integers(0, 9)).map(lambda at: Method("", "", float(at[0]), float(at[1]))),
    min_size=1,
)


def dominates(a, b):
    return a.seconds <= b.seconds and a.error <= b.error and (a.seconds, a.error) != (b.seconds, b.error)


@given(WAYS)
def test_the_front_is_what_nothing_dominates(ways):
    found = {(way.seconds, way.error) for way in front(ways)}
    assert found == {(w.seconds, w.error) for w in ways if not any(dominates(other, w) for other in ways)}


@given(st.floats(-2, 3), st.floats(0.1, 10))
def test_the_exponent_of_a_power_law_is_found(exponent, factor):
    size = np.array([1.0, 2.0, 5.0, 9.0])
    assert growth_exponent(size, factor * size**exponent) == pytest.approx(exponent, abs=1e-9)
