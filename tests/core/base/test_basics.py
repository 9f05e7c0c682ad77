"""Counted nouns, distinct names, messages of errors, estimates with their intervals, and limits of numbers."""

import math
import unicodedata

import numpy as np
import pytest
import scipy.stats
from hypothesis import example, given, settings
from hypothesis import strategies as st

from seip_addon.core.base import limits
from seip_addon.core.base.counts import counted
from seip_addon.core.base.distinct_names import distinct_names
from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.estimates import IntervalEstimate, quantile_of, student_quantile
from seip_addon.core.base.limits import Limits
from seip_addon.core.base.progress import Progress, finish, progress_line, within


@pytest.mark.parametrize(
    ("number", "words", "expected"),
    [
        (0, ("tree",), "0 trees"),
        (1, ("tree",), "1 tree"),
        (12_345, ("tree",), "12,345 trees"),
        (1, ("outline that crosses itself", "outlines that cross themselves"), "1 outline that crosses itself"),
        (2, ("outline that crosses itself", "outlines that cross themselves"), "2 outlines that cross themselves"),
    ],
)
def test_the_noun_follows_the_number(number, words, expected):
    assert counted(number, *words) == expected


@given(st.lists(st.one_of(st.from_regex(r"[aAß](-[12])*", fullmatch=True), st.text(max_size=3)), max_size=30))
@example(["A", "A", "A-2"])
@example(["A-2", "A", "a"])
@settings(max_examples=50, deadline=None)
def test_names_become_distinct(names):
    found = distinct_names(names)
    assert len({name.casefold() for name in found}) == len(names)
    first = [name for number, name in enumerate(names) if name.casefold() not in map(str.casefold, names[:number])]
    assert all(other.startswith(name) for name, other in zip(names, found, strict=True))
    if len(first) == len(names):
        assert found == names


def test_a_sentence_that_repeats_a_whole_file_loses_its_middle():
    sentence = str(SeipError(f"map.xodr: road '{50_000 * 'a'}' has no length; give it one"))
    assert sentence.startswith("map.xodr: road 'aaa")
    assert sentence.endswith("has no length; give it one")
    assert 500 < len(sentence) <= 600


def test_control_characters_are_replaced():
    sentence = str(SeipError("road 'a\x1b[31m\x00\x85' has\nno\tlength"))
    assert sentence == "road 'a\N{REPLACEMENT CHARACTER}[31m\N{REPLACEMENT CHARACTER} ' has no length"
    assert not any(unicodedata.category(one) == "Cc" for one in sentence)


@pytest.mark.parametrize("freedom", [1, 30, 1000])
def test_student_quantiles(freedom):
    assert student_quantile(freedom) == pytest.approx(scipy.stats.t.ppf(0.975, freedom), abs=1e-9)


@pytest.mark.parametrize(
    ("estimate", "words"),
    [
        ((0.0071, -0.001, 0.0152), "0.71 points [-0.10, 1.52] more"),
        ((-0.0071, -0.0152, 0.001), "0.71 points [-0.10, 1.52] less"),
        ((-0.0071, -math.inf, math.inf), "0.71 points less [too few data for an interval]"),
        ((0.0, 0.0, 0.0), "0.00 points [0.00, 0.00] more"),
    ],
)
def test_a_loss_is_called_a_loss(estimate, words):
    assert IntervalEstimate(*estimate).as_change() == words


@pytest.mark.parametrize("share", [0.05, 0.5])
def test_a_quantile_is_in_its_interval_as_often_as_is_said(share):
    rng, hits = np.random.default_rng(0), 0
    for _ in range(600):
        found = quantile_of(rng.standard_normal(200), share)
        assert found.low <= found.value <= found.high
        hits += found.low <= scipy.stats.norm.ppf(share) <= found.high
    assert hits / 600 > 0.93


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


def search(values):
    for value in values:
        yield Progress(0, 0, "swapping sensors", best=f"{value}%", gap=0.5)
    return values[-1]


def test_whole_shows_the_value_and_gap_of_its_part():
    whole = Progress(1, 3, "placing for the worst quarter", counted=False)
    shown = []
    assert finish(within(whole, search([70, 71])), shown.append) == 71
    assert [progress_line(one) for one in shown] == [
        f"placing for the worst quarter: 33% done, {value}%, gap at most 50.0%" for value in (70, 71)
    ]


def test_work_is_closed_where_its_report_raises():
    closed = []

    def work():
        try:
            yield Progress(0, 0, "rendering")
        finally:
            closed.append(True)

    def interrupted(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        finish(work(), interrupted)
    assert closed == [True]
