"""Changes of average precision, pair by pair."""

import math

from headless.detection.average_precision import evaluate
from headless.detection.matching import Rule
from headless.studies.paired_change import ResampledPrecision, change, level

import numpy as np
import pytest
import scipy.stats

from seip_addon.core.estimates import student_quantile
from tests.builders.labelled_frames import box, detected, frame, traffic, truth

RULE = Rule()
CARS = [box(20.0 * number) for number in range(10)]


def sampled(found, runs=8):
    """Runs of a frame each with ten cars, of which so many are found."""
    counts = found if isinstance(found, list) else [found] * runs
    frames = [
        frame(truth(CARS), detected(CARS[:count], [0.9] * count), run=f"run {number}")
        for number, count in enumerate(counts)
    ]
    return ResampledPrecision(evaluate(frames, RULE))


def test_nothing_changes_from_a_trial_to_itself():
    frames = [told for number in range(5) for told in traffic(number, frames=4, run=f"run {number}")]
    one = ResampledPrecision(evaluate(frames, RULE))
    same = change([one], [one])
    assert (same.value, same.low, same.high) == (0.0, 0.0, 0.0)


def test_one_car_in_ten_missed_everywhere_is_a_tenth_and_certain():
    lost = change([sampled(9)], [sampled(10)])
    assert lost.value == pytest.approx(-0.1, abs=1e-12)
    assert (lost.low, lost.high) == pytest.approx((-0.1, -0.1), abs=1e-12)


def test_pairs_tell_what_levels_do_not():
    """Runs differ by far more than what is lost, but each loses."""
    before, after = sampled([10, 2, 9, 3, 10, 2, 8, 4]), sampled([9, 1, 8, 2, 9, 1, 7, 3])
    assert level([after]).agrees_with(level([before]))
    assert change([after], [before]).high < -0.05


BEFORE, AFTER = [10, 10, 9, 9, 10, 8, 8, 10], [10, 8, 9, 5, 9, 8, 6, 9]


def test_the_interval_over_traffic_is_students_of_the_runs():
    """With as many cars in each run and no false detection the change is the mean of the runs' own changes."""
    one = change([sampled(AFTER)], [sampled(BEFORE)])
    own = (np.array(AFTER) - BEFORE) / 10
    theirs = scipy.stats.t.interval(0.95, 7, own.mean(), scipy.stats.sem(own))
    assert (one.low, one.high) == pytest.approx(theirs, abs=1e-9)


def test_of_other_traffic_nothing_is_paired():
    one = change([sampled(AFTER)], [sampled(BEFORE[:5])], same_traffic=False)
    reach = math.hypot(
        *(scipy.stats.t.ppf(0.975, len(own) - 1) * scipy.stats.sem(own) / 10 for own in (AFTER, BEFORE[:5]))
    )
    assert (one.low, one.high) == pytest.approx((one.value - reach, one.value + reach), abs=1e-9)


def test_intervals_stay_within_what_can_be():
    scattered = [sampled([10, 0, 0, 0]), sampled([0, 10, 0, 0]), sampled([10, 10, 10, 0])]
    there = level(scattered)
    assert 0.0 <= there.low < there.value < there.high <= 1.0
    difference = change(scattered, [sampled(10, runs=4), sampled(0, runs=4), sampled(10, runs=4)])
    assert -1.0 <= difference.low < difference.value < difference.high <= 1.0


def test_the_interval_over_trainings_is_students():
    """Losses of 1, 2 and 3 cars in ten, the same in every run: mean 0.2, standard deviation 0.1."""
    three = change([sampled(9), sampled(8), sampled(7)], [sampled(10)] * 3)
    reach = student_quantile(2) * 0.1 / math.sqrt(3)
    assert three.value == pytest.approx(-0.2)
    assert (three.low, three.high) == pytest.approx((-0.2 - reach, -0.2 + reach))


def test_both_together_add_up_as_squares():
    before, after = sampled(BEFORE), sampled(AFTER)
    alone = change([after], [before])
    reach = student_quantile(1) * alone.value / 2  # of 0 and the value: their standard deviation is |value| / √2
    both = change([after, before], [before, before])
    assert both.value == pytest.approx(alone.value / 2)
    over_traffic = (alone.high - alone.low) / 4  # half as wide: one of the two detectors changes nothing
    assert both.high - both.value == pytest.approx(math.hypot(over_traffic, reach))
    assert both.value - both.low == pytest.approx(math.hypot(over_traffic, reach))


def test_too_little_traffic_leaves_the_ends_open():
    few = change([sampled(9, runs=3)], [sampled(10, runs=3)])
    assert few.value == pytest.approx(-0.1)
    assert (few.low, few.high) == (-math.inf, math.inf)
    assert level([sampled(9, runs=3)]).high == math.inf
