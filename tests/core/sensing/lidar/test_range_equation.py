"""The range equation: ranges of the data sheet come out again, and probabilities follow the formula."""

import math
from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.lidar.range_equation import RangeEquation

laws = st.builds(
    RangeEquation,
    threshold=st.floats(-16.0, -6.0),
    spread=st.floats(0.2, 2.0),
    ceiling=st.floats(0.8, 1.0),
    extinction=st.floats(0.0, 0.05),
)


@given(at_10=st.floats(1.0, 200.0), more=st.floats(1.3, 4.0), probability=st.floats(0.05, 0.95))
def test_ranges_of_the_data_sheet_come_out_again(at_10, more, probability):
    law = RangeEquation.of_ranges(at_10, at_10 * more, probability)
    assert law.reach(0.1, probability) == pytest.approx(at_10, rel=1e-9)
    if more <= math.sqrt(8.0):  # else the ranges contradict 1/r², and the shorter one counts
        assert law.reach(0.8, probability) == pytest.approx(at_10 * more, rel=1e-9)
    else:
        assert law.extinction == 0.0


@given(law=laws, distance=st.floats(0.1, 500.0), cos=st.floats(-1.0, 1.0), reflectivity=st.floats(0.001, 1.0))
def test_probability_is_the_formula(law, distance, cos, reflectivity):
    found = law.chance(np.array([distance]), np.array([abs(cos) * reflectivity]))[0]
    power = abs(cos) * reflectivity * math.exp(-2 * law.extinction * distance) / distance**2
    exact = 0.0 if power == 0.0 else NormalDist(law.threshold, law.spread).cdf(math.log(power)) * law.ceiling
    assert found == pytest.approx(exact, abs=2e-7)


def test_light_lost_in_air_shortens_the_range():
    clear = RangeEquation.of_ranges(40.0, 110.0)
    assert clear.in_air(0.01).reach(0.1, 0.9) < 30.0 < clear.reach(0.1, 0.9)


@pytest.mark.parametrize(
    ("at_10", "at_80"),
    [(0.0, 9.0), (9.0, 9.0), (9.0, 4.0), (9.0, 9.1), (math.nan, 1.0), (1.0, math.inf), (1e200, 1e250), (1e-9, 1.0)],
)
def test_ranges_that_contradict_each_other_are_refused(at_10, at_80):
    with pytest.raises(SeipError, match="the range at 80 % reflectivity"):
        RangeEquation.of_ranges(at_10, at_80)
