"""Limits of what is read: what they allow, what they say, and that every file of arrays has them."""

import math
from importlib import import_module

import numpy as np
import pytest

from seip_addon.core import limits
from seip_addon.core.errors import SeipError
from seip_addon.core.limits import Limits
from seip_addon.core.storage.array_file import ArrayRule

ALL = {name: value for name, value in vars(limits).items() if isinstance(value, Limits)}
FILES = (
    "seip_addon.core.sensing.scans.frame",
    "seip_addon.core.sensing.traffic.trajectories",
    "seip_addon.core.sensing.visibility.grid",
    "seip_addon.core.output.results.site_file",
)


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
    assert limits.TOTAL_WEIGHT.fault(-1.0) == "is -1, not at least 0"
    assert Limits(1, 1e15).fault(10**30) == f"is {10**30}, not at most 1e+15"
    with pytest.raises(SeipError, match=r"map\.xml: length is -7, not 0 to 1,000,000 m; export it again"):
        limits.ROAD_LENGTH.require(-7.0, "map.xml", "length", "export it again")


@pytest.mark.parametrize("module", FILES)
def test_every_array_of_floating_point_numbers_has_limits(module):
    for name, rule in import_module(module).FILE.arrays.items():
        assert rule.limits is not None or not rule.dtype.startswith("f"), name
    with pytest.raises(ValueError, match="needs limits"):
        ArrayRule("f8", ("n",))
