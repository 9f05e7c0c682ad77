"""The range equation: ranges of the data sheet come out again, and probabilities follow the formula."""

import math
from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.errors import SeipError
from seip_addon.core.lidar.range_equation import DetectionLaw

laws = st.builds(
    DetectionLaw,
    threshold=st.floats(-16.0, -6.0),
    spread=st.floats(0.2, 2.0),
    ceiling=st.floats(0.8, 1.0),
    extinction=st.floats(0.0, 0.05),
)


@given(at_10=st.floats(1.0, 200.0), more=st.floats(1.05, 4.0), probability=st.floats(0.05, 0.95))
def test_ranges_of_the_data_sheet_come_out_again(at_10, more, probability):
    law = DetectionLaw.of_ranges(at_10, at_10 * more, probability)
    assert law.reach(0.1, probability) == pytest.approx(at_10, rel=1e-9)
    if more <= math.sqrt(8.0):  # else the ranges contradict 1/r², and the shorter one counts
        assert law.reach(0.8, probability) == pytest.approx(at_10 * more, rel=1e-9)
    else:
        assert law.extinction == 0.0


@given(law=laws, distance=st.floats(0.1, 500.0), cos=st.floats(-1.0, 1.0), reflectivity=st.floats(0.001, 1.0))
def test_probability_is_the_formula(law, distance, cos, reflectivity):
    found = law.probability(np.array([distance]), np.array([cos]), reflectivity)[0]
    power = abs(cos) * reflectivity * math.exp(-2 * law.extinction * distance) / distance**2
    exact = 0.0 if power == 0.0 else NormalDist(law.threshold, law.spread).cdf(math.log(power)) * law.ceiling
    assert found == pytest.approx(exact, abs=2e-7)


@given(law=laws, reflectivity=st.floats(0.01, 1.0), cos=st.floats(0.01, 1.0), share=st.floats(0.01, 0.99))
def test_within_reach_a_surface_is_detected_and_beyond_it_is_not(law, reflectivity, cos, share):
    probability = share * law.ceiling
    reach, least = law.reach(reflectivity, probability, cos), law.least_power(probability)
    inside, outside = np.array([reach * 0.999]), np.array([reach * 1.001])
    assert law.power(inside, np.array([cos]), reflectivity)[0] >= least
    assert law.power(outside, np.array([cos]), reflectivity)[0] < least


def test_a_miss_is_never_detected_and_no_number_is_lost_at_no_distance():
    law = DetectionLaw.of_ranges(40.0, 120.0)
    distance, cos = np.array([np.inf, 0.0, 0.0]), np.array([1.0, 1.0, 0.0])
    assert law.probability(distance, cos, 0.5).tolist() == [0.0, law.ceiling, 0.0]


@pytest.mark.parametrize(("at_10", "at_80"), [(0.0, 9.0), (9.0, 9.0), (9.0, 4.0), (math.nan, 1.0), (1.0, math.inf)])
def test_ranges_that_contradict_each_other_are_refused(at_10, at_80):
    with pytest.raises(SeipError, match="the range at 80 % reflectivity"):
        DetectionLaw.of_ranges(at_10, at_80)


@pytest.mark.parametrize("probability", [0.0, 0.985, 1.0, -1.0, math.nan])
def test_a_probability_that_no_return_reaches_is_refused(probability):
    with pytest.raises(SeipError, match=r"must lie above 0 and below 0\.985"):
        DetectionLaw.of_ranges(40.0, 120.0, probability)
