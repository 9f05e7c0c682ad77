"""Changes of average precision, pair by pair."""

import math

from headless.detection.average_precision import evaluate
from headless.detection.matching import Rule
from headless.lab.detector.paired_change import DRAWS, ResampledPrecision, change, level

import pytest
from labelled_frames import box, detected, frame, traffic, truth

from seip_addon.core.estimates import percentiles, student_quantile

RULE = Rule()
CARS = [box(20.0 * number) for number in range(10)]


def sampled(found, seed=0, blocks=8):
    """A run in which each block has a frame of ten cars, of which so many are found."""
    counts = found if isinstance(found, list) else [found] * blocks
    frames = [
        frame(truth(CARS), detected(CARS[:count], [0.9] * count), time=10.0 * number)
        for number, count in enumerate(counts)
    ]
    return ResampledPrecision(evaluate(frames, RULE), seed)


def test_nothing_changes_from_a_trial_to_itself():
    one = ResampledPrecision(evaluate(traffic(1, frames=80, seconds=1.0), RULE))
    same = change([one], [one])
    assert (same.value, same.low, same.high) == (0.0, 0.0, 0.0)


def test_one_car_in_ten_missed_everywhere_is_a_tenth_and_certain():
    lost = change([sampled(9)], [sampled(10)])
    assert lost.value == pytest.approx(-0.1, abs=1e-12)
    assert (lost.low, lost.high) == pytest.approx((-0.1, -0.1), abs=1e-12)


def test_pairs_tell_what_levels_do_not():
    """Blocks differ by far more than what is lost, but each loses."""
    before, after = sampled([10, 2, 9, 3, 10, 2, 8, 4]), sampled([9, 1, 8, 2, 9, 1, 7, 3])
    assert level([after]).agrees_with(level([before]))
    assert change([after], [before]).high < -0.05


def test_the_interval_over_traffic_is_that_of_the_bootstrap():
    before, after = sampled([10, 10, 9, 9, 10, 8, 8, 10]), sampled([10, 8, 9, 5, 9, 8, 6, 9])
    one = change([after], [before])
    assert (one.low, one.high) == pytest.approx(percentiles(after.draws - before.draws))
    assert one.low < one.value < one.high


def test_the_interval_over_trainings_is_students():
    """Losses of 1, 2 and 3 cars in ten, the same in every block: mean 0.2, standard deviation 0.1."""
    three = change([sampled(9), sampled(8), sampled(7)], [sampled(10)] * 3)
    reach = student_quantile(2) * 0.1 / math.sqrt(3)
    assert three.value == pytest.approx(-0.2)
    assert (three.low, three.high) == pytest.approx((-0.2 - reach, -0.2 + reach))


def test_both_together_add_up_as_squares():
    before, after = sampled([10, 10, 9, 9, 10, 8, 8, 10]), sampled([10, 8, 9, 5, 9, 8, 6, 9])
    alone = change([after], [before])
    reach = student_quantile(1) * alone.value / 2  # of 0 and the value: their standard deviation is |value| / √2
    both = change([after, before], [before, before])
    low, high = percentiles((after.draws - before.draws) / 2)
    assert both.value == pytest.approx(alone.value / 2)
    assert both.low == pytest.approx(both.value - math.hypot(both.value - low, reach))
    assert both.high == pytest.approx(both.value + math.hypot(high - both.value, reach))


def test_too_little_traffic_leaves_the_ends_open():
    few = change([sampled(9, blocks=4)], [sampled(10, blocks=4)])
    assert few.value == pytest.approx(-0.1)
    assert (few.low, few.high) == (-math.inf, math.inf)


def test_half_the_draws_are_the_first_half():
    before, after = sampled([10, 10, 9, 9, 10, 8, 8, 10]), sampled([10, 8, 9, 5, 9, 8, 6, 9])
    half = change([after], [before], DRAWS // 2)
    assert (half.low, half.high) == pytest.approx(percentiles((after.draws - before.draws)[: DRAWS // 2]))
