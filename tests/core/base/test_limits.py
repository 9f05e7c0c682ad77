"""Limits of what is read: what they allow and what they say."""

import math

import numpy as np
import pytest

from seip_addon.core.base import limits
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.limits import Limits

ALL = {name: value for name, value in vars(limits).items() if isinstance(value, Limits)}


@pytest.mark.parametrize("name", ALL)
def test_limits_are_finite_and_refuse_what_is_no_number(name):
    one = ALL[name]
    assert -math.inf < one.least < one.most < math.inf
    assert one.allow(one.least)
    assert one.allow(one.most)
    for wrong in (math.nan, math.inf, -math.inf, "1", None, True, [one.least, math.nan], 10**400):
        assert not one.allow(wrong), wrong
    assert not one.allow(np.nextafter(one.most, math.inf))
    assert not one.allow(np.nextafter(one.least, -math.inf))


def test_a_fault_names_the_first_wrong_value_and_the_limits():
    assert limits.HEIGHT.fault([3.0, 0.02]) == ""
    assert limits.HEIGHT.fault([3.0, 1e-300, math.nan]) == "is 1e-300, not 0.01 to 1,000 m"
    assert limits.HEIGHT.fault(10**400).startswith("is 1000000")
    assert limits.SHARE.fault(math.nan) == "is nan, not 0 to 1"
    assert Limits(0.0, 1e15).fault(-1.0) == "is -1, not at least 0"
    assert Limits(1, 1e15).fault(10**30) == f"is {10**30}, not at most 1e+15"
    with pytest.raises(SeipError, match=r"map\.xml: length is -7, not 0 to 1,000,000 m; export it again"):
        limits.ROAD_LENGTH.require(-7.0, "map.xml", "length", "export it again")
