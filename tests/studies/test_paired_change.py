"""Changes of average precision, pair by pair."""

import math

from headless.detection.average_precision import evaluate
from headless.detection.matching import Rule
from headless.studies.paired_change import ResampledPrecision, change, level

import numpy as np
import pytest
import scipy.stats

from seip_addon.core.estimates import student_quantile
from tests.builders.labelled_frames import box, detected, frame, truth

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


def test_the_interval_over_trainings_is_students():
    """Losses of 1, 2 and 3 cars in ten, the same in every run: mean 0.2, standard deviation 0.1."""
    three = change([sampled(9), sampled(8), sampled(7)], [sampled(10)] * 3)
    reach = student_quantile(2) * 0.1 / math.sqrt(3)
    assert three.value == pytest.approx(-0.2)
    assert (three.low, three.high) == pytest.approx((-0.2 - reach, -0.2 + reach))
